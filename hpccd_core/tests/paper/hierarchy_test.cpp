// SPDX-License-Identifier: Apache-2.0
#include "paper/hierarchy.h"

#include "paper/breadth_first.h"
#include "paper/fixture.h"
#include "paper/refit.h"

namespace hpccd::paper {
namespace {

struct HierarchyTest : PaperTest {
  Hierarchy h;
  void SetUp() override {
    move_to(0);
    build(h, features, motion.swept, pool);
  }
};

TEST_F(HierarchyTest, BuiltDownToSingleTriangles) {
  expect_valid(h);
  for (NodeIndex n = 0; n < h.nodes.size(); ++n) EXPECT_NE(h.nodes[n].is_split, h.nodes[n].is_leaf()) << "node " << n;
}

TEST_F(HierarchyTest, SameOnAnyNumberOfThreads) {
  for (int threads : {1, 2, 7}) {
    ThreadPool other_pool(threads);
    Hierarchy other;
    build(other, features, motion.swept, other_pool);
    EXPECT_EQ(other.order, h.order);
  }
}

TEST_F(HierarchyTest, RefitBoundsTheNewStep) {
  for (int step : {1, 5, 9}) {
    move_to(step);
    refit(h, features, motion.swept, pool);
    expect_valid(h);
  }
}

TEST_F(HierarchyTest, RefitStopsAtNodesThatAreNotSplit) {
  move_to(5);
  bound_primitives(h, features, motion.swept, pool);
  const NodeIndex n = h.right(Hierarchy::left(0));
  h.split(n, features);  // the nodes below its children hold what they held before
  ASSERT_FALSE(h.nodes[Hierarchy::left(n)].is_split);
  move_to(6);
  refit(h, features, motion.swept, pool);
  expect_valid(h);
}

TEST_F(HierarchyTest, SplittingTouchesTheSubtreeOnly) {
  move_to(5);
  refit(h, features, motion.swept, pool);
  NodeIndex n = 0;
  while (h.nodes[n].mesh == mixed_meshes) n = h.right(n);
  ASSERT_GT(h.nodes[n].count, 50u);
  const Hierarchy before = h;
  h.split(n, features);
  expect_valid(h);
  const Node& node = before.nodes[n];
  bool moved = false;
  for (std::uint32_t i = 0; i < h.order.size(); ++i) {
    const bool inside = i >= node.begin && i < node.begin + node.count;
    if (!inside) EXPECT_EQ(h.order[i], before.order[i]);
    moved = moved || h.order[i] != before.order[i];
  }
  EXPECT_TRUE(moved) << "the scene should have worn the node out";
  for (NodeIndex m = 0; m < h.nodes.size(); ++m)
    if (m < n || m >= n + 2 * node.count - 1) EXPECT_EQ(h.nodes[m].begin, before.nodes[m].begin) << "node " << m;
}

TEST_F(HierarchyTest, FrontHasTheSizeAskedForAndNoParentWithItsChild) {
  for (std::size_t enough : {1u, 3u, 4u, 16u}) {
    const BreadthFirstFront front = breadth_first_front(h, enough, [&](NodeIndex n) { return h.nodes[n].is_split; });
    EXPECT_EQ(front.low.size(), enough);
    std::vector<int> covered(features.n_primitives());
    for (NodeIndex n : front.low)
      for (std::uint32_t i = h.nodes[n].begin; i < h.nodes[n].begin + h.nodes[n].count; ++i) ++covered[i];
    EXPECT_EQ(std::ranges::count(covered, 1), static_cast<std::ptrdiff_t>(covered.size()));
    std::size_t n_high = 0;
    for (const auto& level : front.high) n_high += level.size();
    EXPECT_EQ(n_high, enough - 1) << "a binary tree of that many leaves";
  }
}

TEST_F(HierarchyTest, FrontEndsAtSingleTriangles) {
  const BreadthFirstFront front = breadth_first_front(h, 1u << 20, [&](NodeIndex n) { return h.nodes[n].is_split; });
  EXPECT_EQ(front.low.size(), features.n_primitives());
}

}  // namespace
}  // namespace hpccd::paper
