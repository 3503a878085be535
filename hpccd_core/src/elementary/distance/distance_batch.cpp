// SPDX-License-Identifier: Apache-2.0
#include "elementary/distance/distance_batch.h"

#include "base/simd/sets.h"

namespace hpccd {

// The functions of distance_batch.inl, compiled for each instruction set.
HPCCD_IN_EACH_SET(BatchTest separation_batch(); BatchTest proximity_batch();)

BatchTest separation_batch(Simd simd) { return HPCCD_OF_SET(simd, separation_batch)(); }

BatchTest proximity_batch(Simd simd) { return HPCCD_OF_SET(simd, proximity_batch)(); }

}  // namespace hpccd
