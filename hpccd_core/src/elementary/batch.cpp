// SPDX-License-Identifier: Apache-2.0
#include "elementary/batch.h"

namespace hpccd {

// Of batch.inl, compiled for each instruction set.
namespace scalar {
BatchTest batch_test(Accuracy);
}
#if defined(HPCCD_X86)
namespace avx2 {
BatchTest batch_test(Accuracy);
}
namespace avx512 {
BatchTest batch_test(Accuracy);
}
#endif

BatchTest batch_test([[maybe_unused]] Simd simd, Accuracy accuracy) {
#if defined(HPCCD_X86)
  if (simd == Simd::avx512) return avx512::batch_test(accuracy);
  if (simd == Simd::avx2) return avx2::batch_test(accuracy);
#endif
  return scalar::batch_test(accuracy);
}

}  // namespace hpccd
