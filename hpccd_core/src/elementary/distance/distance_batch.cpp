// SPDX-License-Identifier: Apache-2.0
#include "elementary/distance/distance_batch.h"

namespace hpccd {

// Of distance_batch.inl, compiled for each instruction set.
namespace scalar {
BatchTest separation_batch();
BatchTest proximity_batch();
}  // namespace scalar
#if defined(HPCCD_X86)
namespace avx2 {
BatchTest separation_batch();
BatchTest proximity_batch();
}  // namespace avx2
namespace avx512 {
BatchTest separation_batch();
BatchTest proximity_batch();
}  // namespace avx512
#endif

BatchTest separation_batch([[maybe_unused]] Simd simd) {
#if defined(HPCCD_X86)
  if (simd == Simd::avx512) return avx512::separation_batch();
  if (simd == Simd::avx2) return avx2::separation_batch();
#endif
  return scalar::separation_batch();
}

BatchTest proximity_batch([[maybe_unused]] Simd simd) {
#if defined(HPCCD_X86)
  if (simd == Simd::avx512) return avx512::proximity_batch();
  if (simd == Simd::avx2) return avx2::proximity_batch();
#endif
  return scalar::proximity_batch();
}

}  // namespace hpccd
