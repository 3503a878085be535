// SPDX-License-Identifier: Apache-2.0
#include "base/simd.h"

#include <algorithm>

#if defined(HPCCD_ARM64) && defined(__linux__)
#include <sys/auxv.h>
#endif

namespace hpccd {

const char* name_of(Simd simd) {
  switch (simd) {
    case Simd::automatic:
      return "auto";
    case Simd::scalar:
      return "scalar";
    case Simd::avx2:
      return "avx2";
    case Simd::avx512:
      return "avx512";
    case Simd::neon:
      return "neon";
  }
  return "?";
}

Simd resolve(Simd wanted) {
  const auto levels = simd_levels();
  if (wanted == Simd::automatic) return levels.back();
  if (std::find(levels.begin(), levels.end(), wanted) == levels.end())
    throw InvalidArgument(std::string("simd: this machine or build has no ") + name_of(wanted) +
                          "; leave the choice to the detector (\"auto\")");
  return wanted;
}

}  // namespace hpccd

// Outside of the namespace: inside, a declaration of the inline namespace would be declared again.
std::vector<hpccd::Simd> hpccd::simd_levels() {
  std::vector<Simd> levels{Simd::scalar};
#if defined(HPCCD_X86)
  if (__builtin_cpu_supports("avx2")) levels.push_back(Simd::avx2);
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw") &&
      __builtin_cpu_supports("avx512vl"))
    levels.push_back(Simd::avx512);
#elif defined(HPCCD_ARM64) && defined(__linux__)
  if (getauxval(AT_HWCAP) & HWCAP_ASIMD) levels.push_back(Simd::neon);
#elif defined(HPCCD_ARM64)
  levels.push_back(Simd::neon);
#endif
  return levels;
}
