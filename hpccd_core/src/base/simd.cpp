// SPDX-License-Identifier: Apache-2.0
#include "base/simd.h"

#include <algorithm>

#include "elementary/batch.h"
#include "traverse/leaf_pairs.h"

namespace hpccd {

namespace scalar {
void run(const Geometry&, Kind, const std::uint32_t*, const std::uint32_t*, std::uint32_t, BatchResult&);
void run_fast(const Geometry&, Kind, const std::uint32_t*, const std::uint32_t*, std::uint32_t, BatchResult&);
void leaf_pairs(const Tree&, const LeafRange&, const LeafRange&, CandidateBuffer&, CandidateBuffer&);
}  // namespace scalar
#if defined(HPCCD_X86)
namespace avx2 {
void run(const Geometry&, Kind, const std::uint32_t*, const std::uint32_t*, std::uint32_t, BatchResult&);
void run_fast(const Geometry&, Kind, const std::uint32_t*, const std::uint32_t*, std::uint32_t, BatchResult&);
void leaf_pairs(const Tree&, const LeafRange&, const LeafRange&, CandidateBuffer&, CandidateBuffer&);
}  // namespace avx2
namespace avx512 {
void run(const Geometry&, Kind, const std::uint32_t*, const std::uint32_t*, std::uint32_t, BatchResult&);
void run_fast(const Geometry&, Kind, const std::uint32_t*, const std::uint32_t*, std::uint32_t, BatchResult&);
void leaf_pairs(const Tree&, const LeafRange&, const LeafRange&, CandidateBuffer&, CandidateBuffer&);
}  // namespace avx512
#endif

std::vector<Simd> simd_levels() {
  std::vector<Simd> levels{Simd::scalar};
#if defined(HPCCD_X86)
  if (__builtin_cpu_supports("avx2")) levels.push_back(Simd::avx2);
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw") &&
      __builtin_cpu_supports("avx512vl"))
    levels.push_back(Simd::avx512);
#endif
  return levels;
}

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
  }
  return "?";
}

Simd resolve(Simd wanted) {
  const auto levels = simd_levels();
  if (wanted == Simd::automatic) return levels.back();
  if (std::find(levels.begin(), levels.end(), wanted) == levels.end())
    throw InvalidArgument(std::string("simd: this machine or build has no ") + name_of(wanted) + "; use \"auto\"");
  return wanted;
}

BatchTest batch_test(Simd simd, Accuracy accuracy) {
  const bool fast = accuracy == Accuracy::fast;
#if defined(HPCCD_X86)
  if (simd == Simd::avx512) return fast ? avx512::run_fast : avx512::run;
  if (simd == Simd::avx2) return fast ? avx2::run_fast : avx2::run;
#endif
  (void)simd;
  return fast ? scalar::run_fast : scalar::run;
}

LeafPairs leaf_pairs(Simd simd) {
#if defined(HPCCD_X86)
  if (simd == Simd::avx512) return avx512::leaf_pairs;
  if (simd == Simd::avx2) return avx2::leaf_pairs;
#endif
  (void)simd;
  return scalar::leaf_pairs;
}

}  // namespace hpccd
