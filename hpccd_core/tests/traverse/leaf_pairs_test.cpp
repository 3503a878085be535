// SPDX-License-Identifier: Apache-2.0
// The candidates of two leaves: with every instruction set just the pairs of features whose boxes overlap and that
// share no vertex.
#include "traverse/leaf_pairs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "base/simd.h"
#include "bvh/motion_bounds.h"
#include "grid_scene.h"

namespace hpccd {
namespace {

using Pairs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

struct Found {
  Pairs edge_edge, vertex_face;
  bool operator==(const Found&) const = default;
};

struct LeafPairsTest : testing::Test {
  static constexpr std::uint32_t side = 13, lone = 3;
  std::shared_ptr<const Scene> scene = test::two_sheets(side, lone);
  Features features = features_of(*scene);
  ThreadPool pool{1};
  MotionBounds motion;
  Tree tree;

  LeafPairsTest() {
    const auto start = test::sheet_positions(side, 0, lone), end = test::sheet_positions(side, 1, lone);
    motion.update(test::view(start), test::view(end), pool);
    build(tree, *scene, features, motion, pool);
  }

  template <class VerticesA, class VerticesB>
  bool are_candidates(const VerticesA& a, const VerticesB& b) const {
    MotionBox box_a, box_b;
    for (const std::uint32_t v : a) box_a.include(motion.boxes[v]);
    for (const std::uint32_t v : b) box_b.include(motion.boxes[v]);
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

TEST_F(LeafPairsTest, AreThoseThatOverlapAndShareNoVertex) {
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
  EXPECT_GT(vertex_face, 500u);
}

}  // namespace
}  // namespace hpccd
