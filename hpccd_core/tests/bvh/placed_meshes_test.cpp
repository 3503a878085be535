// SPDX-License-Identifier: Apache-2.0
#include "bvh/placed_meshes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "scene/mesh_poses.h"
#include "soup_scene.h"

namespace hpccd {
namespace {

constexpr std::uint32_t n = 200;  // triangles of each of two meshes

struct PlacedMeshesTest : testing::TestWithParam<double> {
  PlacedMeshesTest() {
    std::vector<double> x = test::soup_positions(n, 3);
    for (double& coordinate : x) coordinate += GetParam();  // far from the origin of their frames
    scene = std::make_shared<Scene>(*test::soup_scene(n));
    for (std::uint32_t m = 0; m < 2; ++m) scene->set_shape(m, std::span(x).subspan(9 * n * m, 9 * n));
    features = features_of(*scene);
  }

  // The far shape is brought back to the origin.
  std::vector<rigid::Pose> random_poses() {
    std::normal_distribution<double> number;
    std::vector<Pose> poses(2);
    for (Pose& pose : poses) {
      double length = 0;
      for (double& x : pose.quaternion) x = number(random), length += x * x;
      for (double& x : pose.quaternion) x /= std::sqrt(length);
      const rigid::Placing turn(
          rigid::Pose{{pose.quaternion[0], pose.quaternion[1], pose.quaternion[2], pose.quaternion[3]}, {0, 0, 0}});
      const rigid::Vector far = turn({GetParam(), GetParam(), GetParam()});
      pose.position = {number(random) - far.x, number(random) - far.y, number(random) - far.z};
    }
    return poses_of_meshes(*scene, poses);
  }

  std::mt19937 random{7};
  std::shared_ptr<Scene> scene;
  Features features;
  ThreadPool pool{2};
};

bool contains(const Box& outer, const Box& inner) {
  for (int k = 0; k < 3; ++k)
    if (inner.low[k] < outer.low[k] || inner.high[k] > outer.high[k]) return false;
  return true;
}

// Fitted leaves are those of positions, and each node's bounds contain the leaves below.
TEST_P(PlacedMeshesTest, BoundsContainFittedLeaves) {
  PlacedMeshes placed(*scene, features, pool);
  for (int round = 0; round < 4; ++round) {
    const std::vector<rigid::Pose> poses = random_poses();
    ASSERT_TRUE(placed.place(poses));
    const std::vector<double> positions = place_meshes(*scene, poses, {}, 1, pool);
    Tree& tree = placed.tree();
    parallel_for(pool, tree.leaves.size(), 1, [&](std::size_t begin, std::size_t, int) {
      placed.fit(static_cast<std::uint32_t>(begin));
      placed.fit(static_cast<std::uint32_t>(tree.leaves.size() - 1 - begin));
    });
    for (std::uint32_t v = 0; v < scene->n_vertices(); ++v)
      for (std::size_t k = 0; k < 3; ++k) {
        EXPECT_EQ(placed.snapshot().vertices[v].t0[k], positions[3 * v + k]);
        EXPECT_EQ(placed.snapshot().vertices[v].t1[k], positions[3 * v + k]);
      }
    std::vector<Node> at(tree.nodes.size());
    for (std::size_t i = tree.nodes.size(); i-- > 0;) {
      at[i] = placed.at_pose(tree.nodes[i]);
      if (!tree.nodes[i].children) {
        EXPECT_TRUE(contains(at[i].box.t0, tree.nodes[i].box.t0));
        EXPECT_TRUE(contains(at[i].box.t1, tree.nodes[i].box.t1));
      }
    }
    for (std::uint32_t leaf = 0; leaf < tree.leaves.size(); ++leaf)
      for (const std::uint32_t root : {0u, tree.nodes[0].children, tree.nodes[0].children + 1}) {
        const Node& fitted = tree.node_of_leaf(leaf);
        if (at[root].mesh != mixed_meshes && at[root].mesh != fitted.mesh) continue;
        EXPECT_TRUE(contains(at[root].box.t0, fitted.box.t0));
        EXPECT_TRUE(contains(at[root].box.t1, fitted.box.t1));
      }
  }
}

INSTANTIATE_TEST_SUITE_P(, PlacedMeshesTest, testing::Values(0.0, 100.0, 1e6));

TEST(Poses, AreNormalisedAndChecked) {
  Scene scene = *test::soup_scene(1);
  const std::vector<double> shape(9, 0.5);
  scene.set_shape(0, shape);
  const auto pose_of = [&](Pose pose) { return poses_of_meshes(scene, {&pose, 1})[0]; };
  EXPECT_EQ(pose_of({{1, 2, 3}, {0, 0, 0.6, 0.8}}).turn.z, 0.6 / std::sqrt(0.6 * 0.6 + 0.8 * 0.8));
  EXPECT_EQ(pose_of({{1, 2, 3}, {0, 0, 0, 1.0005}}).turn.w, 1);
  EXPECT_THROW(pose_of({{1, 2, 3}, {0, 0, 0, 1.01}}), InvalidArgument);
  EXPECT_THROW(pose_of({{1, 2, NAN}, {0, 0, 0, 1}}), InvalidArgument);
  EXPECT_THROW(poses_of_meshes(scene, std::vector<Pose>(2)), InvalidArgument);
  EXPECT_EQ(poses_of_meshes(scene, {}).size(), 2u);
  EXPECT_THROW(scene.set_shape(1, std::span(shape).first(6)), InvalidArgument);
  scene.set_shape(scene.add_mesh("empty", {}, 0), {});
  EXPECT_EQ(poses_of_meshes(scene, std::vector<Pose>(2)).size(), 3u);
}

}  // namespace
}  // namespace hpccd
