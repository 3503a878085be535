// SPDX-License-Identifier: Apache-2.0
#include "traverse/leaf_pairs.h"

namespace hpccd {

// Of leaf_pairs.inl, compiled for each instruction set.
namespace scalar {
std::uint32_t block_pairs(const Tree&, const Block&, const Block&, LeafPair*);
void leaf_pairs(const Tree&, const LeafRange&, const LeafRange&, TestedFeatures, CandidateBuffer&, CandidateBuffer&);
void leaf_pairs_until(const Tree&, const LeafRange&, const LeafRange&, TestedFeatures, float, CandidateBuffer&,
                      CandidateBuffer&);
void leaf_pairs_at_start(const Tree&, const LeafRange&, const LeafRange&, TestedFeatures, float, CandidateBuffer&,
                         CandidateBuffer&);
void leaf_pairs_in_snapshot(const Tree&, const LeafRange&, const LeafRange&, TestedFeatures, float, CandidateBuffer&,
                            CandidateBuffer&);
}  // namespace scalar
#if defined(HPCCD_X86)
namespace avx2 {
std::uint32_t block_pairs(const Tree&, const Block&, const Block&, LeafPair*);
void leaf_pairs(const Tree&, const LeafRange&, const LeafRange&, TestedFeatures, CandidateBuffer&, CandidateBuffer&);
void leaf_pairs_until(const Tree&, const LeafRange&, const LeafRange&, TestedFeatures, float, CandidateBuffer&,
                      CandidateBuffer&);
void leaf_pairs_at_start(const Tree&, const LeafRange&, const LeafRange&, TestedFeatures, float, CandidateBuffer&,
                         CandidateBuffer&);
void leaf_pairs_in_snapshot(const Tree&, const LeafRange&, const LeafRange&, TestedFeatures, float, CandidateBuffer&,
                            CandidateBuffer&);
}  // namespace avx2
namespace avx512 {
std::uint32_t block_pairs(const Tree&, const Block&, const Block&, LeafPair*);
void leaf_pairs(const Tree&, const LeafRange&, const LeafRange&, TestedFeatures, CandidateBuffer&, CandidateBuffer&);
void leaf_pairs_until(const Tree&, const LeafRange&, const LeafRange&, TestedFeatures, float, CandidateBuffer&,
                      CandidateBuffer&);
void leaf_pairs_at_start(const Tree&, const LeafRange&, const LeafRange&, TestedFeatures, float, CandidateBuffer&,
                         CandidateBuffer&);
void leaf_pairs_in_snapshot(const Tree&, const LeafRange&, const LeafRange&, TestedFeatures, float, CandidateBuffer&,
                            CandidateBuffer&);
}  // namespace avx512
#endif

BlockPairs block_pairs([[maybe_unused]] Simd simd) {
#if defined(HPCCD_X86)
  if (simd == Simd::avx512) return avx512::block_pairs;
  if (simd == Simd::avx2) return avx2::block_pairs;
#endif
  return scalar::block_pairs;
}

LeafPairs leaf_pairs([[maybe_unused]] Simd simd) {
#if defined(HPCCD_X86)
  if (simd == Simd::avx512) return avx512::leaf_pairs;
  if (simd == Simd::avx2) return avx2::leaf_pairs;
#endif
  return scalar::leaf_pairs;
}

LeafPairsUntil leaf_pairs_until([[maybe_unused]] Simd simd) {
#if defined(HPCCD_X86)
  if (simd == Simd::avx512) return avx512::leaf_pairs_until;
  if (simd == Simd::avx2) return avx2::leaf_pairs_until;
#endif
  return scalar::leaf_pairs_until;
}

LeafPairsInSnapshot leaf_pairs_at_start([[maybe_unused]] Simd simd) {
#if defined(HPCCD_X86)
  if (simd == Simd::avx512) return avx512::leaf_pairs_at_start;
  if (simd == Simd::avx2) return avx2::leaf_pairs_at_start;
#endif
  return scalar::leaf_pairs_at_start;
}

LeafPairsInSnapshot leaf_pairs_in_snapshot([[maybe_unused]] Simd simd) {
#if defined(HPCCD_X86)
  if (simd == Simd::avx512) return avx512::leaf_pairs_in_snapshot;
  if (simd == Simd::avx2) return avx2::leaf_pairs_in_snapshot;
#endif
  return scalar::leaf_pairs_in_snapshot;
}

}  // namespace hpccd
