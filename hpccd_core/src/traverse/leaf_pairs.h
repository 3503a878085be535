// SPDX-License-Identifier: Apache-2.0
// Candidate feature pairs of two leaves: pairs with overlapping boxes and no common vertex.
#pragma once

#include "bvh/tree.h"

namespace hpccd {

struct CandidateBuffer {
  // One pair of leaves adds at most (3 * leaf_size)^2 edge-edge pairs and 2 * 3 * leaf_size * leaf_size vertex-face or
  // edge-face pairs.
  static constexpr std::uint32_t capacity = 2048;
  static constexpr std::uint32_t most_per_call = 9 * Tree::leaf_size * Tree::leaf_size;
  std::uint32_t n = 0;
  // With space for a full vector store beyond the last pair.
  std::uint32_t first[capacity + Tree::load_width], second[capacity + Tree::load_width];
};

// Appends edges a, b with a < b to `edge_edge`, and vertex and face to `vertex_face`, as far as they are tested. a ==
// b: pairs within one leaf.
using LeafPairs = void (*)(const Tree& tree, const LeafRange& a, const LeafRange& b, TestedFeatures tested,
                           CandidateBuffer& edge_edge, CandidateBuffer& vertex_face);

LeafPairs leaf_pairs(Simd simd);

// Two leaves whose boxes overlap, by number. For the published methods a leaf is one triangle, so these are the paper's
// triangle indices.
struct LeafPair {
  std::uint32_t first, second;
};

// Writes the pairs of leaves of two blocks, or of one, whose boxes and k-DOPs overlap; returns their number.
inline constexpr std::uint32_t block_pairs_capacity =
    Block::width * Block::width + 1;  // writes one pair more than it counts
using BlockPairs = std::uint32_t (*)(const Tree& tree, const Block& a, const Block& b, LeafPair* pairs);

BlockPairs block_pairs(Simd simd);

// The same for the motion up to a time below 1.
using LeafPairsUntil = void (*)(const Tree& tree, const LeafRange& a, const LeafRange& b, TestedFeatures tested,
                                float until, CandidateBuffer& edge_edge, CandidateBuffer& vertex_face);

LeafPairsUntil leaf_pairs_until(Simd simd);
// reach: how far boxes at the start may be apart; negative: boxes up to that time count. margin: see until() in
// elementary/kdop_lanes.inl.
using BlockPairsUntil = std::uint32_t (*)(const Tree& tree, const Block& a, const Block& b, float until, float reach,
                                          const KdopMargin& margin, LeafPair* pairs);

BlockPairsUntil block_pairs_until(Simd simd);

// The same for two meshes whose boxes have grown by more than their separation requires (traverse/excess.h).
using BlockPairsLessExcess = std::uint32_t (*)(const Tree& tree, const Block& a, const Block& b, float excess,
                                               LeafPair* pairs);
using LeafPairsLessExcess = void (*)(const Tree& tree, const LeafRange& a, const LeafRange& b, TestedFeatures tested,
                                     float excess, CandidateBuffer& edge_edge, CandidateBuffer& vertex_face);

BlockPairsLessExcess block_pairs_less_excess(Simd simd);
LeafPairsLessExcess leaf_pairs_less_excess(Simd simd);

// The same for one snapshot: features whose boxes at t = 0 are at most `reach` apart along every axis.
using LeafPairsInSnapshot = void (*)(const Tree& tree, const LeafRange& a, const LeafRange& b, TestedFeatures tested,
                                     float reach, CandidateBuffer& edge_edge, CandidateBuffer& vertex_face);

LeafPairsInSnapshot leaf_pairs_in_snapshot(Simd simd);
using BlockPairsInSnapshot = std::uint32_t (*)(const Tree& tree, const Block& a, const Block& b, float reach,
                                               LeafPair* pairs);

BlockPairsInSnapshot block_pairs_in_snapshot(Simd simd);
// The same for the start of a motion.
LeafPairsInSnapshot leaf_pairs_at_start(Simd simd);

}  // namespace hpccd
