// SPDX-License-Identifier: Apache-2.0
// The device's functions for meshes at poses, called on the host: bounds and positions are those of the CPU, and bounds
// contain the corners as the device maps them.
#include "gpu/mesh_at_pose.h"

#include <gtest/gtest.h>

#include <bit>
#include <random>

#include "bvh/kdop.h"
#include "scene/mesh_poses.h"
#include "sheets_and_solids.h"

namespace hpccd {
namespace {

using test::Body;
using Random = std::mt19937;

void expect_those_of_the_cpu(const PlacedMeshes& placed, std::span<const double> positions) {
  std::vector<gpu::MeshAtPose> meshes;
  for (const PlacedMeshes::Placed& mesh : placed.meshes()) meshes.push_back(gpu::MeshAtPose::of(mesh));
  const Tree& tree = placed.tree();
  const CoordinateMap& map = placed.snapshot().map;
  for (std::size_t i = 0; i < tree.nodes.size(); ++i) {
    const Node& node = tree.nodes[i];
    if (node.mesh == mixed_meshes) continue;
    const Box& local = placed.local_boxes()[i];
    const gpu::LocalBox box{
        {local.low[0], local.low[1], local.low[2]}, node.mesh, {local.high[0], local.high[1], local.high[2]}, 0};
    const gpu::BoundsAtPose found = gpu::bounds_at(&meshes[box.mesh], box);
    const MotionBox expected = placed.at_pose(node).box;
    for (int k = 0; k < 3; ++k) {
      ASSERT_EQ(found.low[0][k], expected.t0.low[k]);
      ASSERT_EQ(found.high[0][k], expected.t0.high[k]);
      ASSERT_EQ(found.low[1][k], expected.t1.low[k]);
      ASSERT_EQ(found.high[1][k], expected.t1.high[k]);
    }
    if (node.children) continue;
    const LeafRange& leaf = tree.leaves[node.leaf];
    for (std::uint32_t c = leaf.first_corner; c < leaf.end_corner; ++c) {
      const std::uint32_t vertex = tree.corners[c];
      const PlacedMeshes::Placed& mesh = placed.meshes()[node.mesh];
      const double* shape = mesh.shape + 3 * std::size_t{vertex - mesh.first_vertex};
      const Vec3<double> x = meshes[node.mesh].placing({shape[0], shape[1], shape[2]});
      const double at[3] = {x.x, x.y, x.z};
      const SlantedCoordinates slanted(x, map);
      for (int k = 0; k < 3; ++k) {
        ASSERT_EQ(std::bit_cast<std::uint64_t>(at[k]),
                  std::bit_cast<std::uint64_t>(positions[3 * vertex + static_cast<std::size_t>(k)]));
        const float along = map(at[k], k);
        ASSERT_TRUE(found.low[0][k] <= along && along <= found.high[0][k]);
        ASSERT_TRUE(found.low[1][k] <= slanted.along[k] && slanted.along[k] <= found.high[1][k]);
      }
    }
  }
}

TEST(MeshAtPose, GivesTheBoundsAndPositionsOfTheCpu) {
  Random random(5);
  const std::vector<Body> all{test::sphere(9, 1),       test::sheet(12, 0.2),    test::soup(random, 40, 0.3),
                              test::rope(random, 20),   test::sphere(5, 1e-3),   test::sphere(6, 200),
                              test::points(random, 12), test::soup(random, 1, 1)};
  ThreadPool pool{1};
  int n_placed = 0;
  for (unsigned round = 0; round < 40; ++round) {
    const double far = round % 4 == 3 ? 1e6 : 0;
    auto scene = std::make_shared<Scene>();
    for (unsigned m = 0; m < 1 + round % 4; ++m) {
      Body b = all[random() % all.size()];
      for (double& x : b.positions) x += far;
      scene->add_mesh("m" + std::to_string(m), b.faces, static_cast<std::uint32_t>(b.positions.size() / 3),
                      {.points = b.points}, b.edges);
      scene->set_shape(m, b.positions);
    }
    const Features features = features_of(*scene);
    PlacedMeshes placed(*scene, features, pool);
    for (int frame = 0; frame < 4; ++frame) {
      std::vector<Pose> poses;
      for (unsigned m = 0; m < scene->meshes().size(); ++m)
        poses.push_back(test::random_pose(random, round % 3 ? 2 : 300, frame % 3 != 0));
      const std::vector<rigid::Pose> of_meshes = poses_of_meshes(*scene, poses);
      if (!placed.place(of_meshes)) continue;
      ++n_placed;
      expect_those_of_the_cpu(placed, place_meshes(*scene, of_meshes, {}, 1, pool));
      if (HasFatalFailure()) return;
    }
  }
  EXPECT_GT(n_placed, 80);
}

}  // namespace
}  // namespace hpccd
