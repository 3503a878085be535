// SPDX-License-Identifier: Apache-2.0
#include "elementary/intersection_batch.h"

#include "base/simd/sets.h"

namespace hpccd {

// The function of intersection_batch.inl, compiled for each instruction set.
HPCCD_IN_EACH_SET(void intersection_batch(const Geometry&, const std::uint32_t*, const std::uint32_t*, std::uint32_t,
                                          BatchResult&);)

IntersectionBatch intersection_batch(Simd simd) { return HPCCD_OF_SET(simd, intersection_batch); }

}  // namespace hpccd
