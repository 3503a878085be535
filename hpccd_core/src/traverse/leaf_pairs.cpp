// SPDX-License-Identifier: Apache-2.0
#include "traverse/leaf_pairs.h"

#include "base/simd/sets.h"

namespace hpccd {

// The functions of leaf_pairs.inl, compiled for each instruction set.
HPCCD_IN_EACH_SET(std::uint32_t block_pairs(const Tree&, const Block&, const Block&, LeafPair*);
                  void leaf_pairs(const Tree&, const LeafRange&, const LeafRange&, TestedFeatures, CandidateBuffer&,
                                  CandidateBuffer&);
                  void leaf_pairs_until(const Tree&, const LeafRange&, const LeafRange&, TestedFeatures, float,
                                        CandidateBuffer&, CandidateBuffer&);
                  std::uint32_t block_pairs_less_excess(const Tree&, const Block&, const Block&, float, LeafPair*);
                  std::uint32_t block_pairs_until(const Tree&, const Block&, const Block&, float, float,
                                                  const KdopMargin&, LeafPair*);
                  std::uint32_t block_pairs_in_snapshot(const Tree&, const Block&, const Block&, float, LeafPair*);
                  void leaf_pairs_less_excess(const Tree&, const LeafRange&, const LeafRange&, TestedFeatures, float,
                                              CandidateBuffer&, CandidateBuffer&);
                  void leaf_pairs_at_start(const Tree&, const LeafRange&, const LeafRange&, TestedFeatures, float,
                                           CandidateBuffer&, CandidateBuffer&);
                  void leaf_pairs_in_snapshot(const Tree&, const LeafRange&, const LeafRange&, TestedFeatures, float,
                                              CandidateBuffer&, CandidateBuffer&);)

BlockPairs block_pairs(Simd simd) { return HPCCD_OF_SET(simd, block_pairs); }

LeafPairs leaf_pairs(Simd simd) { return HPCCD_OF_SET(simd, leaf_pairs); }

LeafPairsUntil leaf_pairs_until(Simd simd) { return HPCCD_OF_SET(simd, leaf_pairs_until); }

BlockPairsUntil block_pairs_until(Simd simd) { return HPCCD_OF_SET(simd, block_pairs_until); }

BlockPairsInSnapshot block_pairs_in_snapshot(Simd simd) { return HPCCD_OF_SET(simd, block_pairs_in_snapshot); }

BlockPairsLessExcess block_pairs_less_excess(Simd simd) { return HPCCD_OF_SET(simd, block_pairs_less_excess); }

LeafPairsLessExcess leaf_pairs_less_excess(Simd simd) { return HPCCD_OF_SET(simd, leaf_pairs_less_excess); }

LeafPairsInSnapshot leaf_pairs_at_start(Simd simd) { return HPCCD_OF_SET(simd, leaf_pairs_at_start); }

LeafPairsInSnapshot leaf_pairs_in_snapshot(Simd simd) { return HPCCD_OF_SET(simd, leaf_pairs_in_snapshot); }

}  // namespace hpccd
