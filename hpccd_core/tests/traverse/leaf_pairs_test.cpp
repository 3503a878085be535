// SPDX-License-Identifier: Apache-2.0
// The candidates of two leaves: with every instruction set just the pairs of features whose boxes overlap and that
// share no vertex; and the pairs of leaves of two blocks: just those whose boxes and k-DOPs overlap.
#include "traverse/leaf_pairs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>

#include "base/simd.h"
#include "bvh/motion_bounds.h"
#include "grid_scene.h"
#include "rope_scene.h"
#include "soup_scene.h"

namespace hpccd {
namespace {

using Pairs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

struct Found {
  Pairs edge_edge, vertex_face;
  bool operator==(const Found&) const = default;
};

enum class Of { sheets, soup, ropes };

// Sheets, whose leaves have some ten corners; triangles that hang together by twos at most, whose leaves have up to
// twenty-four; or edges in no triangle. With a separation, so that boxes of vertices are more than points, or without.
struct Case {
  Of of;
  double separation;
};

std::string name_of_case(const testing::TestParamInfo<Case>& info) {
  const char* names[] = {"Sheets", "Soup", "Ropes"};
  return std::string(names[static_cast<int>(info.param.of)]) + (info.param.separation > 0 ? "Apart" : "");
}

struct LeafPairsTest : testing::TestWithParam<Case> {
  static constexpr std::uint32_t side = 13, lone = 3, triangles = 300;
  std::shared_ptr<const Scene> scene = GetParam().of == Of::sheets ? test::two_sheets(side, lone)
                                       : GetParam().of == Of::soup ? test::soup_scene(triangles)
                                                                   : test::rope_scene(triangles);
  Features features = features_of(*scene);
  ThreadPool pool{1};
  MotionBounds motion;
  Tree tree;

  std::vector<double> first, last;  // positions at both ends

  LeafPairsTest() {
    const bool soup = GetParam().of != Of::sheets;
    first = soup ? test::soup_positions(triangles, 1) : test::sheet_positions(side, 0, lone);
    last = soup ? test::soup_positions(triangles, 2) : test::sheet_positions(side, 1, lone);
    const std::vector<double> separations(2, GetParam().separation);
    motion.update(*scene, test::view(first), test::view(last), Growth{separations}, pool);
    build(tree, *scene, features, motion, pool);
  }

  float excess = 0;  // by which boxes must overlap at least

  template <class VerticesA, class VerticesB>
  bool are_candidates(const VerticesA& a, const VerticesB& b) const {
    MotionBox box_a, box_b;
    for (const std::uint32_t v : a) box_a.include(motion.boxes[v]);
    for (const std::uint32_t v : b) box_b.include(motion.boxes[v]);
    for (Box* box : {&box_a.t0, &box_a.t1})
      for (int k = 0; k < 3; ++k) box->low[k] += excess, box->high[k] -= excess;
    return box_a.overlaps(box_b) && std::ranges::find_first_of(a, b) == std::ranges::end(a);
  }

  void add_vertex_faces(const LeafRange& a, const LeafRange& b, Pairs& out) const {
    for (auto i = a.first_vertex; i < a.end_vertex; ++i)
      for (auto j = b.first_face; j < b.end_face; ++j) {
        const std::uint32_t vertex = tree.vertex_of_slot[i], face = tree.face_of_slot[j];
        if (are_candidates(std::array{vertex}, features.faces[face])) out.push_back({vertex, face});
      }
  }

  Found one_by_one(const LeafRange& a, const LeafRange& b) const {
    Found found;
    for (auto i = a.first_edge; i < a.end_edge; ++i)
      for (auto j = &a == &b ? i + 1 : b.first_edge; j < b.end_edge; ++j) {
        const std::uint32_t x = tree.edge_of_slot[i], y = tree.edge_of_slot[j];
        if (are_candidates(features.edges[x], features.edges[y])) found.edge_edge.push_back(std::minmax(x, y));
      }
    add_vertex_faces(a, b, found.vertex_face);
    if (&a != &b) add_vertex_faces(b, a, found.vertex_face);
    return sorted(found);
  }

  Found by(LeafPairs leaf_pairs, const LeafRange& a, const LeafRange& b, TestedFeatures tested = {}) const {
    const auto edge_edge = std::make_unique<CandidateBuffer>(), vertex_face = std::make_unique<CandidateBuffer>();
    leaf_pairs(tree, a, b, tested, *edge_edge, *vertex_face);
    return sorted({pairs_of(*edge_edge), pairs_of(*vertex_face)});
  }

  Found less_excess(LeafPairsLessExcess leaf_pairs, const LeafRange& a, const LeafRange& b) const {
    const auto edge_edge = std::make_unique<CandidateBuffer>(), vertex_face = std::make_unique<CandidateBuffer>();
    leaf_pairs(tree, a, b, {}, excess, *edge_edge, *vertex_face);
    return sorted({pairs_of(*edge_edge), pairs_of(*vertex_face)});
  }

  static bool holds(const Found& all, const Found& some) {
    return std::ranges::includes(all.edge_edge, some.edge_edge) &&
           std::ranges::includes(all.vertex_face, some.vertex_face);
  }

  static Pairs pairs_of(const CandidateBuffer& buffer) {
    Pairs pairs;
    for (std::uint32_t i = 0; i < buffer.n; ++i) pairs.push_back({buffer.first[i], buffer.second[i]});
    return pairs;
  }
  static Found sorted(Found found) {
    std::ranges::sort(found.edge_edge);
    std::ranges::sort(found.vertex_face);
    return found;
  }
};

TEST_P(LeafPairsTest, AreThoseThatOverlapAndShareNoVertex) {
  std::size_t edge_edge = 0, vertex_face = 0;
  for (std::size_t a = 0; a < tree.leaves.size(); ++a)
    for (std::size_t b = a; b < tree.leaves.size(); ++b) {
      const Found expected = one_by_one(tree.leaves[a], tree.leaves[b]);
      edge_edge += expected.edge_edge.size(), vertex_face += expected.vertex_face.size();
      for (const Simd simd : simd_levels()) {
        ASSERT_EQ(by(leaf_pairs(simd), tree.leaves[a], tree.leaves[b]), expected)
            << "leaves " << a << " and " << b << ", " << name_of(simd);
        ASSERT_EQ(by(leaf_pairs(simd), tree.leaves[a], tree.leaves[b], {.edge_edge = false}),
                  (Found{{}, expected.vertex_face}));
        ASSERT_EQ(by(leaf_pairs(simd), tree.leaves[a], tree.leaves[b], {.vertex_face = false}),
                  (Found{expected.edge_edge, {}}));
      }
    }
  EXPECT_GT(edge_edge, 1000u);
  EXPECT_GT(vertex_face, GetParam().of == Of::ropes ? 200u : 500u);
}

// Boxes that have grown by more than required: exactly the pairs that overlap by less than the excess are left out.
TEST_P(LeafPairsTest, AreThoseThatOverlapByMoreThanTheExcess) {
  if (GetParam().separation == 0) GTEST_SKIP() << "no box has grown";
  constexpr float by = 0.1f, lost = 1e-5f;
  std::size_t left_out = 0, left = 0;
  for (std::size_t a = 0; a < tree.leaves.size(); ++a)
    for (std::size_t b = a; b < tree.leaves.size(); ++b) {
      const LeafRange &leaf_a = tree.leaves[a], &leaf_b = tree.leaves[b];
      excess = 0;
      const Found all = one_by_one(leaf_a, leaf_b);
      excess = by - lost;
      const Found most = one_by_one(leaf_a, leaf_b);
      excess = by + lost;
      const Found least = one_by_one(leaf_a, leaf_b);
      excess = by;
      left_out += all.edge_edge.size() - most.edge_edge.size(), left += least.edge_edge.size();
      for (const Simd simd : simd_levels()) {
        const Found found = less_excess(leaf_pairs_less_excess(simd), leaf_a, leaf_b);
        ASSERT_TRUE(holds(found, least) && holds(most, found)) << a << " and " << b << ", " << name_of(simd);
      }
    }
  EXPECT_GT(left_out, 100u);
  EXPECT_GT(left, 100u);
}

struct BlockPairsTest : LeafPairsTest {
  Kdop kdop_of(std::uint32_t number) const {
    const LeafRange& leaf = tree.leaves[number];
    Kdop k;
    std::fill_n(k.low, 16, INFINITY);
    std::fill_n(k.high, 16, -INFINITY);
    for (auto c = leaf.first_corner; c < leaf.end_corner; ++c)
      for (int i = 0; i < 16; ++i) {
        const VertexKdop& v = motion.kdops[tree.corners[c]];
        const float x = (i < 8 ? v.t0 : v.t1)[i % 8];
        k.low[i] = std::min(k.low[i], x), k.high[i] = std::max(k.high[i], x);
      }
    if (!motion.grown) return k;
    const std::uint32_t mesh = tree.nodes[tree.leaf_nodes[number]].mesh;
    const KdopMargin margin{motion.margin_of_mesh(mesh) + motion.rounding, motion.map.scale};
    for (int i = 0; i < 16; ++i) k.low[i] -= margin.in[i], k.high[i] += margin.in[i];
    return k;
  }
  static bool apart(const Kdop& a, const Kdop& b) {
    for (int i = 0; i < 8; ++i)
      if ((a.high[i] < b.low[i] && a.high[i + 8] < b.low[i + 8]) ||
          (b.high[i] < a.low[i] && b.high[i + 8] < a.low[i + 8]))
        return true;
    return false;
  }
  // Separated along one direction at the start and at a time, by more than a margin and `more`.
  static bool apart_until(const Kdop& a, const Kdop& b, const KdopMargin& margin, float time, double more) {
    const auto open = [&](const float* high, const float* low, int i) {
      const double at_t0 = double{low[i]} - high[i], at_t1 = double{low[i + 8]} - high[i + 8];
      return std::min(at_t0, at_t0 + time * (at_t1 - at_t0)) > margin.in[i] + more;
    };
    for (int i = 0; i < 8; ++i)
      if (open(a.high, b.low, i) || open(b.high, a.low, i)) return true;
    return false;
  }
  // The pairs of leaves that find(simd, block, block, pairs) returns, on every instruction set, are some of those for
  // which `at_most` holds, among them all for which `at_least` holds, but for those that their k-DOPs separate.
  template <class AtLeast, class AtMost, class Find, class Separated>
  void expect_between(AtLeast&& at_least, AtMost&& at_most, Find&& find, Separated&& separated) {
    Pairs least, most;
    for (std::uint32_t a = 0; a < tree.leaves.size(); ++a)
      for (std::uint32_t b = a; b < tree.leaves.size(); ++b) {
        const Node &node_a = tree.node_of_leaf(a), &node_b = tree.node_of_leaf(b);
        if (a == b || (at_least(node_a, node_b) && !separated(a, b, 0))) least.push_back({a, b});
        if (a == b || (at_most(node_a, node_b) && !separated(a, b, 8e-6))) most.push_back({a, b});
      }
    EXPECT_LT(least.size(), tree.leaves.size() * (tree.leaves.size() + 1) / 2);
    for (const Simd simd : simd_levels()) {
      Pairs found;
      for (std::size_t a = 0; a < tree.blocks.size(); ++a)
        for (std::size_t b = a; b < tree.blocks.size(); ++b) {
          LeafPair pairs[block_pairs_capacity];
          const std::uint32_t n = find(simd, tree.blocks[a], tree.blocks[b], pairs);
          for (std::uint32_t i = 0; i < n; ++i) found.push_back(std::minmax(pairs[i].first, pairs[i].second));
        }
      std::ranges::sort(found);
      EXPECT_TRUE(std::ranges::includes(found, least) && std::ranges::includes(most, found)) << name_of(simd);
    }
  }
  void expect_leaves_that_overlap() const {
    Pairs expected;
    for (std::uint32_t a = 0; a < tree.leaves.size(); ++a)
      for (std::uint32_t b = a; b < tree.leaves.size(); ++b) {
        const Node &node_a = tree.nodes[tree.leaf_nodes[a]], &node_b = tree.nodes[tree.leaf_nodes[b]];
        const bool touch = a == b || !apart(kdop_of(a), kdop_of(b));
        if (node_a.box.overlaps(node_b.box) && touch) expected.push_back({a, b});
      }
    for (const Simd simd : simd_levels()) {
      Pairs found;
      for (std::size_t a = 0; a < tree.blocks.size(); ++a)
        for (std::size_t b = a; b < tree.blocks.size(); ++b) {
          LeafPair pairs[block_pairs_capacity];
          const std::uint32_t n = block_pairs(simd)(tree, tree.blocks[a], tree.blocks[b], pairs);
          for (std::uint32_t i = 0; i < n; ++i) found.push_back(std::minmax(pairs[i].first, pairs[i].second));
        }
      std::ranges::sort(found);
      EXPECT_EQ(found, expected) << name_of(simd);
    }
  }
};

TEST_P(BlockPairsTest, AreTheLeavesThatOverlap) {
  ASSERT_GT(tree.blocks.size(), 2u);
  expect_leaves_that_overlap();
}

TEST_P(BlockPairsTest, AreTheLeavesThatOverlapByMoreThanTheExcess) {
  if (GetParam().separation == 0) GTEST_SKIP() << "no box has grown";
  constexpr float by = 0.1f, lost = 1e-5f;
  Pairs most, least;
  for (std::uint32_t a = 0; a < tree.leaves.size(); ++a)
    for (std::uint32_t b = a; b < tree.leaves.size(); ++b) {
      const Node &node_a = tree.nodes[tree.leaf_nodes[a]], &node_b = tree.nodes[tree.leaf_nodes[b]];
      if (a != b && apart(kdop_of(a), kdop_of(b))) continue;
      if (node_a.overlaps(node_b, by - lost)) most.push_back({a, b});
      if (node_a.overlaps(node_b, by + lost)) least.push_back({a, b});
    }
  for (const Simd simd : simd_levels()) {
    Pairs found;
    for (std::size_t a = 0; a < tree.blocks.size(); ++a)
      for (std::size_t b = a; b < tree.blocks.size(); ++b) {
        LeafPair pairs[block_pairs_capacity];
        const std::uint32_t n = block_pairs_less_excess(simd)(tree, tree.blocks[a], tree.blocks[b], by, pairs);
        for (std::uint32_t i = 0; i < n; ++i) found.push_back(std::minmax(pairs[i].first, pairs[i].second));
      }
    std::ranges::sort(found);
    EXPECT_TRUE(std::ranges::includes(found, least) && std::ranges::includes(most, found)) << name_of(simd);
  }
}

// A part of the motion, and snapshots: no pair of leaves is left out that the boxes of nodes leave near, and only pairs
// are that those boxes, a little larger, leave near.
TEST_P(BlockPairsTest, AreTheLeavesThatAreNearUntilATime) {
  const KdopMargin margin(motion.margin_of_mesh(0) * 2 + motion.rounding, motion.map.scale);
  for (const float until : {0.0f, 0.3f, 0.99f})
    for (const float reach : {-1.0f, 0.0f, 0.05f})
      expect_between(
          [&](const Node& a, const Node& b) {
            return reach < 0 ? a.overlap_until(b, until) : a.near_at_start(b, reach - 1e-6f);
          },
          [&](const Node& a, const Node& b) {
            return reach < 0 ? a.overlap_until(b, until) : a.near_at_start(b, reach + 1e-6f);
          },
          [&](Simd simd, const Block& a, const Block& b, LeafPair* pairs) {
            return block_pairs_until(simd)(tree, a, b, until, reach, margin, pairs);
          },
          [&](std::uint32_t a, std::uint32_t b, double more) {
            return apart_until(kdop_of(a), kdop_of(b), margin, until, more);
          });
}

TEST_P(BlockPairsTest, AreTheLeavesThatAreNearInASnapshot) {
  motion.update(*scene, test::view(first), pool);
  refit(tree, motion, {}, pool);
  for (const float reach : {0.0f, 0.02f, 0.3f})
    expect_between([&](const Node& a, const Node& b) { return a.near_in_snapshot(b, reach - 1e-6f); },
                   [&](const Node& a, const Node& b) { return a.near_in_snapshot(b, reach + 1e-6f); },
                   [&](Simd simd, const Block& a, const Block& b, LeafPair* pairs) {
                     return block_pairs_in_snapshot(simd)(tree, a, b, reach, pairs);
                   },
                   [](std::uint32_t, std::uint32_t, double) { return false; });
}

// Boxes and k-DOPs grow with the separation: those of an earlier motion with another separation are invalid.
TEST_P(BlockPairsTest, AreThoseOfTheLastBounds) {
  for (const double separation : {0.4, 0.0, 0.2, 0.1, 0.0}) {
    for (auto* end : {&last, &first}) {
      const std::vector<double> separations(2, separation);
      motion.update(*scene, test::view(first), test::view(*end), Growth{separations}, pool);
      refit(tree, motion, {}, pool);
      ASSERT_NO_FATAL_FAILURE(expect_leaves_that_overlap());
    }
  }
}

const auto cases = testing::Values(Case{Of::sheets, 0}, Case{Of::sheets, 0.3}, Case{Of::soup, 0}, Case{Of::soup, 0.3},
                                   Case{Of::ropes, 0}, Case{Of::ropes, 0.3});
INSTANTIATE_TEST_SUITE_P(Scenes, BlockPairsTest, cases, name_of_case);
INSTANTIATE_TEST_SUITE_P(Scenes, LeafPairsTest, cases, name_of_case);

}  // namespace
}  // namespace hpccd
