// SPDX-License-Identifier: Apache-2.0
#include "elementary/intersection_batch.h"

namespace hpccd {

// Of intersection_batch.inl, compiled for each instruction set.
namespace scalar {
void intersection_batch(const Geometry&, const std::uint32_t*, const std::uint32_t*, std::uint32_t, BatchResult&);
}
#if defined(HPCCD_X86)
namespace avx2 {
void intersection_batch(const Geometry&, const std::uint32_t*, const std::uint32_t*, std::uint32_t, BatchResult&);
}
namespace avx512 {
void intersection_batch(const Geometry&, const std::uint32_t*, const std::uint32_t*, std::uint32_t, BatchResult&);
}
#endif

IntersectionBatch intersection_batch([[maybe_unused]] Simd simd) {
#if defined(HPCCD_X86)
  if (simd == Simd::avx512) return avx512::intersection_batch;
  if (simd == Simd::avx2) return avx2::intersection_batch;
#endif
  return scalar::intersection_batch;
}

}  // namespace hpccd
