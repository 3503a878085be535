// SPDX-License-Identifier: Apache-2.0
// The trees of many worlds: common as long as it serves them, else a world's own.
#include "backends/moving_tree.h"

#include <gtest/gtest.h>

#include <numeric>
#include <random>

#include "grid_scene.h"

namespace hpccd {
namespace {

constexpr std::uint32_t n_triangles = 300;

std::shared_ptr<const Scene> triangles() {
  std::vector<std::uint32_t> corners(3 * n_triangles);
  std::iota(corners.begin(), corners.end(), 0u);
  auto scene = std::make_shared<Scene>();
  scene->add_mesh("triangles", corners, 3 * n_triangles, {});
  return scene;
}

// Each triangle in a place of its own: a tree that is made for one number is worn out by another.
std::vector<double> pose(unsigned number, double shifted = 0) {
  std::mt19937 random(number);
  std::uniform_real_distribution<double> place(0, 100);
  std::vector<double> positions;
  for (std::uint32_t i = 0; i < n_triangles; ++i) {
    const double x = place(random) + shifted, y = place(random), z = place(random);
    for (int corner = 0; corner < 3; ++corner) positions.insert(positions.end(), {x + corner, y + corner % 2, z});
  }
  return positions;
}

// As for more worlds than there is room for trees, unless the number says otherwise.
struct Trees {
  explicit Trees(std::size_t n_worlds = std::size_t{1} << 30) : budget(n_worlds) {}
  // A query of this world. Returns the number of the tree that served it.
  std::uint64_t ask(OwnTree& own, const std::vector<double>& positions, bool always = false) {
    moving.begin_world(own, budget, always);
    moving.bound(test::view(positions), test::view(positions), {});
    moving.fit(profiler);
    EXPECT_FALSE(worn_out(moving.tree().wear, moving.tree().wear_when_built));
    const std::uint64_t number = moving.number();
    moving.end_world();
    return number;
  }
  std::shared_ptr<const Scene> scene = triangles();
  ThreadPool pool{1};
  Features features = features_of(*scene);
  MovingTree moving{*scene, features, pool};
  TreeBudget budget;
  Profiler profiler;
};

const std::vector<double> flat = pose(1);

TEST(MovingTree, WorldsOfLikePosesShareATree) {
  Trees trees;
  OwnTree a, b;
  const auto first = trees.ask(a, flat);
  for (int i = 0; i < 4; ++i) {
    EXPECT_EQ(trees.ask(b, pose(1, 0.5)), first);
    EXPECT_EQ(trees.ask(a, flat), first);
  }
  EXPECT_FALSE(a.kept || b.kept);
}

TEST(MovingTree, AWorldThatWearsTheCommonOneTwiceGetsItsOwn) {
  Trees trees;
  OwnTree a, b, c;
  trees.ask(a, pose(1)), trees.ask(b, pose(2));
  EXPECT_FALSE(a.kept || b.kept);
  trees.ask(a, pose(1));
  const auto own = trees.ask(b, pose(2));
  EXPECT_TRUE(b.kept && !a.kept);
  const auto common = trees.ask(a, pose(1));
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(trees.ask(b, pose(2)), own);
    EXPECT_EQ(trees.ask(a, pose(1)), common);
    EXPECT_EQ(trees.ask(c, pose(1, 0.5)), common);
  }
}

TEST(MovingTree, AnOwnTreeThatIsWornOutGivesWayToTheCommonOne) {
  Trees trees;
  OwnTree a, b;
  for (int i = 0; i < 2; ++i) trees.ask(a, pose(1)), trees.ask(b, pose(2));
  ASSERT_TRUE(b.kept);
  const auto common = trees.ask(a, pose(1));
  EXPECT_EQ(trees.ask(b, pose(1, 0.5)), common);
  EXPECT_FALSE(b.kept);
}

TEST(MovingTree, WithoutRoomTheCommonOneIsBuiltAnew) {
  Trees trees;
  OwnTree a, b;
  constexpr std::size_t all = std::size_t{1} << 30;
  ASSERT_TRUE(trees.budget.take(all));
  for (int i = 0; i < 4; ++i) {
    const auto last = trees.ask(a, pose(1));
    EXPECT_NE(trees.ask(b, pose(2)), last);
  }
  EXPECT_FALSE(a.kept || b.kept);
  trees.budget.give_back(all);
  trees.ask(a, pose(1));
  EXPECT_TRUE(a.kept);
}

// How large a tree is, the first one tells, which its world gives up for one of its own.
TEST(MovingTree, WhereThereIsRoomEachWorldKeepsItsOwn) {
  Trees trees(3);
  OwnTree a, b, c;
  trees.ask(a, pose(1));
  const auto of_b = trees.ask(b, pose(2)), of_c = trees.ask(c, flat), of_a = trees.ask(a, pose(1));
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(trees.ask(b, pose(2)), of_b);
    EXPECT_EQ(trees.ask(c, pose(1, 0.5)), of_c);
    EXPECT_EQ(trees.ask(a, pose(1)), of_a);
  }
  const auto another = trees.ask(b, pose(1));  // worn out: another one of its own
  EXPECT_NE(another, of_b);
  EXPECT_NE(another, of_a);
  EXPECT_EQ(trees.ask(b, pose(1)), another);
}

TEST(MovingTree, AlwaysItsOwn) {
  Trees trees;
  OwnTree a, b;
  const auto first = trees.ask(a, flat, true);
  EXPECT_NE(trees.ask(b, flat, true), first);
  EXPECT_EQ(trees.ask(a, flat, true), first);
}

}  // namespace
}  // namespace hpccd
