// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "elementary/distance/distance_batch.h"
#include "traverse/boxes_until.h"
#include "traverse/pair_pool.h"
#include "traverse/worker.h"

namespace hpccd {
namespace {

#include "traverse/walk.inl"

// Down to blocks only, whose leaf boxes are compared in lanes.
struct MotionBoxesOfBlocks : MotionBoxes {
  using Ends = AtBlocks;
  const ContactSearch& search;
  std::uint32_t leaf_pairs(const Block& a, const Block& b, LeafPair* found) const {
    return search.block_pairs(search.tree, a, b, found);
  }
};

// Nodes that may hold an unlisted pair that touches.
struct UnlistedBoxes {
  using Ends = AtLeaves;
  static constexpr bool shrink = false;
  const Tree& tree;
  const Drift& drift;
  float until;
  bool overlap(const Node& a, const Node& b) const { return drift.may_touch(number(a), number(b), until); }
  bool within(const Node& a) const { return overlap(a, a); }

 private:
  std::uint32_t number(const Node& node) const { return static_cast<std::uint32_t>(&node - tree.nodes.data()); }
};

}  // namespace

ContactSearch::ContactSearch(const Tree& tree, const PairRules& rules, Simd simd, bool fast_by_floats)
    : Search(tree, rules, simd) {
  for (unsigned i = 0; i < n_rules; ++i) {
    const Rule rule = Rule::of_number(i);
    const bool as_balanced = rule.accuracy == Accuracy::fast && !fast_by_floats;
    batch_test[i] = rule.separated ? separation_batch(simd)
                                   : hpccd::batch_test(simd, as_balanced ? Accuracy::balanced : rule.accuracy);
    fallback[i] = rule.separated ? decide_separation : decide_contact;
  }
}

void ContactSearch::test_leaves(LeafPair pair, Worker& worker) const {
  const Node &node_a = tree.node_of_leaf(pair.first), &node_b = tree.node_of_leaf(pair.second);
  const LeafRange &a = tree.leaves[pair.first], &b = tree.leaves[pair.second];
  const Rule rule = rules.rule(node_a.mesh, node_b.mesh);
  const TestedFeatures features = tested(rule, node_a.mesh, node_b.mesh);
  const PartOfMotion part = this->part();
  worker.test_candidates(rule, [&](CandidateBuffer& edge_edge, CandidateBuffer& vertex_face) {
    const float less = excess.of(node_a, node_b);
    if (part.until < 1 && part.reach >= 0)
      leaf_pairs_at_start(tree, a, b, features, part.reach - less, edge_edge, vertex_face);
    else if (less > 0)
      leaf_pairs_less_excess(tree, a, b, features, less, edge_edge, vertex_face);
    else if (part.until < 1)
      leaf_pairs_until(tree, a, b, features, part.until, edge_edge, vertex_face);
    else
      leaf_pairs(tree, a, b, features, edge_edge, vertex_face);
  });
}

void ContactSearch::traverse(ThreadPool& pool, std::vector<Worker>& workers) {
  if (excess.any())
    traverse_less_excess(pool, workers);
  else if (report == Report::any)
    traverse_any(MotionBoxes(), *this, pool, workers);
  else if (prunes)
    traverse_all(BoxesUntil{*this}, *this, pool, workers);
  else
    traverse_all(MotionBoxesOfBlocks{{}, *this}, *this, pool, workers);
}

void ContactSearch::traverse_unlisted(const Drift& drift, ThreadPool& pool, std::vector<Worker>& workers) {
  traverse_all(UnlistedBoxes{tree, drift, std::min(until(), 1.0f)}, *this, pool, workers);
}

}  // namespace hpccd
