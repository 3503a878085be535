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

void all_undecided(const Geometry&, Kind, const std::uint32_t*, const std::uint32_t*, std::uint32_t n,
                   BatchResult& result) {
  result.n_contacts = 0;
  result.n_undecided = n;
  for (std::uint32_t i = 0; i < n; ++i) result.undecided[i] = i;
  result.counts.tested += n;
  result.counts.undecided += n;
}

}  // namespace hpccd
