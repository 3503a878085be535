// SPDX-License-Identifier: Apache-2.0
#include "bvh/tree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <functional>
#include <numeric>
#include <string>

#include "bvh/motion_bounds.h"
#include "grid_scene.h"

namespace hpccd {
namespace {

constexpr std::uint32_t side = 17, lone = 3;

bool contains(const Box& outer, const Box& inner) {
  for (int k = 0; k < 3; ++k)
    if (inner.low[k] < outer.low[k] || inner.high[k] > outer.high[k]) return false;
  return true;
}

bool contains(const MotionBox& outer, const MotionBox& inner) {
  return contains(outer.t0, inner.t0) && contains(outer.t1, inner.t1);
}

struct Sheets : testing::Test {
  explicit Sheets(std::uint32_t n) : n(n) {}

  const std::uint32_t n;  // vertices along a side
  std::shared_ptr<const Scene> scene = test::two_sheets(n, lone);
  Features features = features_of(*scene);
  ThreadPool pool{2};
  MotionBounds motion;

  void update(double t0, double t1) {
    const auto start = test::sheet_positions(n, t0, lone), end = test::sheet_positions(n, t1, lone);
    motion.update(test::view(start), test::view(end), pool);
  }
};

struct TreeTest : Sheets {
  TreeTest() : Sheets(side) {}

  Tree tree;

  // Each node's box holds its children's; each leaf's box holds the motion of all vertices of its features.
  void expect_bounds() const {
    for (const Node& node : tree.nodes)
      if (node.children) {
        for (std::uint32_t child : {node.children, node.children + 1})
          EXPECT_TRUE(contains(node.box, tree.nodes[child].box));
      } else {
        const LeafRange& leaf = tree.leaves[node.leaf];
        for (auto slot = leaf.first_face; slot < leaf.end_face; ++slot)
          for (std::uint32_t vertex : features.faces[tree.face_of_slot[slot]])
            EXPECT_TRUE(contains(node.box, motion.boxes[vertex]));
        for (auto slot = leaf.first_edge; slot < leaf.end_edge; ++slot)
          for (std::uint32_t vertex : features.edges[tree.edge_of_slot[slot]])
            EXPECT_TRUE(contains(node.box, motion.boxes[vertex]));
        for (auto slot = leaf.first_vertex; slot < leaf.end_vertex; ++slot)
          EXPECT_TRUE(contains(node.box, motion.boxes[tree.vertex_of_slot[slot]]));
      }
  }
};

TEST_F(TreeTest, EachFeatureLiesInOneLeaf) {
  update(0, 0.3);
  build(tree, *scene, features, motion, pool);
  std::vector<int> faces(features.n_faces()), edges(features.edges.size()), vertices(features.n_vertices);
  for (const LeafRange& leaf : tree.leaves) {
    for (auto slot = leaf.first_face; slot < leaf.end_face; ++slot) ++faces[tree.face_of_slot[slot]];
    for (auto slot = leaf.first_edge; slot < leaf.end_edge; ++slot) ++edges[tree.edge_of_slot[slot]];
    for (auto slot = leaf.first_vertex; slot < leaf.end_vertex; ++slot) ++vertices[tree.vertex_of_slot[slot]];
  }
  EXPECT_EQ(std::ranges::count(faces, 1), static_cast<std::ptrdiff_t>(faces.size()));
  EXPECT_EQ(std::ranges::count(edges, 1), static_cast<std::ptrdiff_t>(edges.size()));
  EXPECT_EQ(std::ranges::count(vertices, 1), static_cast<std::ptrdiff_t>(vertices.size()));
}

TEST_F(TreeTest, BoxesBoundTheMotionAfterBuild) {
  update(0, 0.3);
  build(tree, *scene, features, motion, pool);
  expect_bounds();
}

TEST_F(TreeTest, BoxesBoundTheMotionAfterRefit) {
  update(0, 0.3);
  build(tree, *scene, features, motion, pool);
  update(0.3, 1);
  refit(tree, motion, {}, pool);
  expect_bounds();
}

TEST_F(TreeTest, RefitToTheSameMotionChangesNothing) {
  update(0, 0.3);
  build(tree, *scene, features, motion, pool);
  const std::vector<Node> built = tree.nodes;
  refit(tree, motion, {}, pool);
  for (std::size_t i = 0; i < built.size(); ++i) {
    EXPECT_TRUE(contains(tree.nodes[i].box, built[i].box)) << "node " << i;
    EXPECT_TRUE(contains(built[i].box, tree.nodes[i].box)) << "node " << i;
  }
}

// Input of kernels: rows of corners, and boxes of leaves in lanes.
struct RowsTest : TreeTest {
  void update_with(double separation, double t0, double t1) {
    const auto start = test::sheet_positions(n, t0, lone), end = test::sheet_positions(n, t1, lone);
    const std::vector<double> separations(2, separation);
    motion.update(*scene, test::view(start), test::view(end), Growth{separations}, pool);
  }
  void update_snapshot(double t) { motion.update(*scene, test::view(test::sheet_positions(n, t, lone)), pool); }

  void expect_rows() const {
    for (std::uint32_t i = 0; i < tree.leaves.size(); ++i) {
      const LeafRange& leaf = tree.leaves[i];
      for (std::uint32_t c = 0; c < leaf.n_corners(); ++c) {
        const CornerRow* rows = tree.rows_of(leaf) + c / 16 * tree.rows_per_group();
        const CornerRow* high = rows + (tree.grown ? Tree::coordinates : 0);
        const MotionBox& box = motion.boxes[tree.corners[leaf.first_corner + c]];
        for (int k = 0; k < 3; ++k) {
          ASSERT_EQ(rows[k].lane[c % 16], box.t0.low[k]);
          ASSERT_EQ(rows[3 + k].lane[c % 16], box.t1.low[k]);
          ASSERT_EQ(high[k].lane[c % 16], box.t0.high[k]);
          ASSERT_EQ(high[3 + k].lane[c % 16], box.t1.high[k]);
        }
      }
      const Block& block = tree.blocks[tree.block_of_leaf[i]];
      float bounds[n_bounds];
      std::memcpy(bounds, &tree.nodes[tree.leaf_nodes[i]].box, sizeof bounds);
      for (std::uint32_t k = 0; k < n_bounds; ++k) ASSERT_EQ(block.rows[k][i - block.first_leaf], bounds[k]);
    }
    ASSERT_EQ(tree.by_kdops, motion.has_kdops());
    if (!tree.by_kdops) return;
    ASSERT_EQ(tree.kdops.size(), tree.leaves.size());
    for (std::uint32_t i = 0; i < tree.kdops.size(); ++i)
      for (std::uint32_t c = tree.leaves[i].first_corner; c < tree.leaves[i].end_corner; ++c)
        for (int k = 0; k < 2 * n_kdop_directions; ++k) {
          const VertexKdop& v = motion.kdops[tree.corners[c]];
          const float x = k < n_kdop_directions ? v.t0[k] : v.t1[k - n_kdop_directions];
          ASSERT_LE(tree.kdops[i].low[k], x);
          ASSERT_GE(tree.kdops[i].high[k], x);
        }
  }
};

TEST_F(RowsTest, FollowEveryKindOfBounds) {
  update_with(0, 0, 0.3);
  build(tree, *scene, features, motion, pool);
  ASSERT_NO_FATAL_FAILURE(expect_rows());
  const std::function<void()> kinds[] = {[&] { update_with(0, 0.1, 0.2); }, [&] { update_with(0.2, 0.2, 0.5); },
                                         [&] { update_snapshot(0.4); }};
  for (int from = 0; from < 3; ++from)
    for (int to = 0; to < 3; ++to)
      for (const bool leaves_alone : {false, true}) {
        kinds[from]();
        refit(tree, motion, {}, pool);
        ASSERT_NO_FATAL_FAILURE(expect_rows()) << from;
        kinds[to]();
        std::vector<std::uint32_t> all(tree.leaves.size());
        std::iota(all.begin(), all.end(), 0u);
        if (leaves_alone)
          refit_leaves(tree, motion, all, pool);
        else
          refit(tree, motion, {}, pool);
        ASSERT_NO_FATAL_FAILURE(expect_rows()) << from << " to " << to << (leaves_alone ? ", leaves" : "");
      }
}

// Nodes at rest are not changed, unless the rows are of another kind.
TEST_F(RowsTest, OfWhatRestsComeWithAnotherKindOfBounds) {
  update_with(0, 0, 0.3);
  build(tree, *scene, features, motion, pool);
  update_with(0.2, 0, 0.3);
  refit(tree, motion, {1, 1}, pool);
  expect_rows();
}

// Enough triangles that threads split the upper ranges together and that many nodes lie above the front.
struct LargeTreeTest : Sheets {
  LargeTreeTest() : Sheets(120) {}

  ThreadPool one{1}, four{4};

  static void expect_equal_boxes(const Tree& a, const Tree& b, const std::string& when) {
    EXPECT_EQ(a.wear.area, b.wear.area) << when;
    EXPECT_EQ(a.wear.looseness, b.wear.looseness) << when;
    ASSERT_EQ(a.nodes.size(), b.nodes.size());
    for (std::size_t i = 0; i < a.nodes.size(); ++i)
      ASSERT_EQ(0, std::memcmp(&a.nodes[i].box, &b.nodes[i].box, sizeof(MotionBox))) << when << ", node " << i;
  }
};

TEST_F(LargeTreeTest, IsBuiltAlikeByAnyNumberOfThreads) {
  update(0, 0.3);
  Tree alone;
  build(alone, *scene, features, motion, one);
  for (int threads : {2, 4, 16}) {
    ThreadPool many(threads);
    Tree shared;
    build(shared, *scene, features, motion, many);
    EXPECT_EQ(alone.wear.area, shared.wear.area);
    EXPECT_EQ(alone.face_of_slot, shared.face_of_slot);
    EXPECT_EQ(alone.edge_of_slot, shared.edge_of_slot);
    EXPECT_EQ(alone.vertex_of_slot, shared.vertex_of_slot);
    ASSERT_EQ(alone.nodes.size(), shared.nodes.size());
    EXPECT_EQ(0, std::memcmp(alone.nodes.data(), shared.nodes.data(), alone.nodes.size() * sizeof(Node))) << threads;
  }
}

// Above the front whoever comes second joins the boxes. Many rounds: each would show a box joined too early.
TEST_F(LargeTreeTest, IsRefittedAlikeByAnyNumberOfThreads) {
  update(0, 0.1);
  Tree alone, shared;
  build(alone, *scene, features, motion, one);
  build(shared, *scene, features, motion, one);
  ASSERT_GT(shared.above_front.size(), 64u);
  for (int round = 0; round < 200; ++round) {
    const double t = 0.005 * (round % 100);
    update(t, t + 0.1);
    refit(alone, motion, {}, one);
    refit(shared, motion, {}, four);
    ASSERT_NO_FATAL_FAILURE(expect_equal_boxes(alone, shared, "round " + std::to_string(round)));
  }
}

TEST_F(LargeTreeTest, RefitLeavesOutWhatRestsAndNothingAboveIt) {
  update(0, 0.1);
  Tree whole, part;
  build(whole, *scene, features, motion, one);
  build(part, *scene, features, motion, one);
  const std::vector<MotionBox> before = motion.boxes;
  update(0.1, 0.2);
  std::copy_n(before.begin(), n * n + lone, motion.boxes.begin());  // the first sheet
  refit(whole, motion, {}, four);
  refit(part, motion, {1, 0}, four);
  expect_equal_boxes(whole, part, "at rest");
}

}  // namespace
}  // namespace hpccd
