// SPDX-License-Identifier: Apache-2.0
// Distances on the GPU are bit-identical to those on the CPU: random scenes of every kind of mesh, one frame after the
// other, so that the last frame's nearest pairs are used as bounds. By positions and by poses.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "gpu/device.h"
#include "hpccd/hpccd.h"
#include "sheets_and_solids.h"

namespace hpccd {
namespace {

using test::Body;
using Random = std::mt19937;

struct Frames {
  std::shared_ptr<const Scene> scene;
  std::vector<std::vector<double>> positions;
  std::uint32_t worlds = 1;
};

void expect_same(const Gap& found, const Gap& expected) {
  EXPECT_EQ(found.mesh_a, expected.mesh_a);
  EXPECT_EQ(found.mesh_b, expected.mesh_b);
  EXPECT_EQ(found.distance, expected.distance);
  EXPECT_EQ(found.kind, expected.kind);
  EXPECT_EQ(found.features, expected.features);
  EXPECT_EQ(found.points, expected.points);
  EXPECT_EQ(found.vertices, expected.vertices);
  EXPECT_EQ(found.weights, expected.weights);
  EXPECT_EQ(found.normal, expected.normal);
  EXPECT_EQ(found.inside, expected.inside);
}

void expect_same_distances(const Frames& f, bool by_the_device = true) {
  Detector cpu(f.scene, {.backend = Backend::cpu, .worlds = f.worlds}),
      gpu(f.scene, {.backend = Backend::gpu, .worlds = f.worlds});
  for (const std::vector<double>& positions : f.positions) {
    const std::vector<float> floats(positions.begin(), positions.end());
    for (const Positions& p : {Positions::of(positions), Positions::of(floats)}) {
      const std::vector<Gap> found = gpu.distances(p), expected = cpu.distances(p);
      ASSERT_EQ(found.size(), expected.size());
      for (std::size_t i = 0; i < found.size(); ++i) expect_same(found[i], expected[i]);
      if (by_the_device) {
        EXPECT_EQ(gpu.last_backend(), Backend::gpu) << gpu.last_gpu_error();
      }
      if (::testing::Test::HasFailure()) return;
    }
  }
}

class NearestOnDevice : public ::testing::Test {
 protected:
  void SetUp() override {
    if (gpu::status().devices.empty()) GTEST_SKIP() << gpu::status().reason;
  }
};

// `bodies` once a frame, each displaced and bent a little.
Frames frames_of(const std::vector<Body>& bodies, unsigned seed, int n, double way, double noise,
                 const std::function<void(Scene&)>& options = {}, std::uint32_t worlds = 1) {
  auto scene = std::make_shared<Scene>();
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const Body& b = bodies[i];
    scene->add_mesh("body" + std::to_string(i), b.faces, static_cast<std::uint32_t>(b.positions.size() / 3),
                    {.points = b.points}, b.edges);
  }
  if (options) options(*scene);
  Frames f{scene, {}, worlds};
  Random random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int frame = 0; frame < n; ++frame) {
    std::vector<double>& all = f.positions.emplace_back();
    for (std::uint32_t world = 0; world < worlds; ++world)
      for (const Body& b : bodies) {
        const double by[3] = {way * unit(random), way * unit(random), way * unit(random)};
        for (std::size_t i = 0; i < b.positions.size(); ++i)
          all.push_back(b.positions[i] + by[i % 3] + noise * unit(random));
      }
  }
  return f;
}

TEST_F(NearestOnDevice, OfSolidsApartTouchingNestedAndIntersecting) {
  for (const unsigned seed : {1u, 2u, 3u}) {
    for (const double distance : {30.0, 2.3, 2.0, 1.0, 0.2})
      expect_same_distances(
          frames_of({test::sphere(24, 1), test::moved(test::sphere(17, 1), {distance, 0.3 * distance, 0.1})}, seed, 4,
                    0.05, 0.01));
    expect_same_distances(
        frames_of({test::sphere(20, 2), test::sphere(9, 0.3), test::sheet(12, 0.3)}, seed, 4, 0.4, 0));
  }
}

TEST_F(NearestOnDevice, OfSheetsWithinThemselves) {
  for (const unsigned seed : {1u, 2u}) {
    // Without noise many pairs are at the same distance.
    for (const double noise : {0.0, 0.05, 0.4})
      expect_same_distances(
          frames_of({test::sheet(30, 1), test::moved(test::sheet(23, 1), {3, 4, 0.7})}, seed, 3, 0.3, noise));
    expect_same_distances(frames_of({test::sheet(2, 1)}, seed, 2, 0.3, 0.1));
    expect_same_distances(frames_of({test::sheet(3, 1)}, seed, 2, 0.3, 0));
  }
}

TEST_F(NearestOnDevice, OfSoupRopesAndPoints) {
  for (const unsigned seed : {1u, 2u, 3u, 4u}) {
    Random random(seed);
    const std::vector<Body> bodies{
        test::soup(random, 60, 0.4), test::rope(random, 40),
        test::points(random, 50),    test::moved(test::soup(random, 5, 0.02), {1, 1, 3}),
        test::rope(random, 3),       test::with_isolated_vertices(test::sheet(6, 0.2), random, 9)};
    expect_same_distances(frames_of(bodies, seed, 4, 1, 0.02));
  }
}

TEST_F(NearestOnDevice, OfTheSamePlacesAndDegenerateTriangles) {
  for (const unsigned seed : {1u, 2u}) {
    Random random(seed);
    Body flat = test::sheet(12, 1);
    for (std::size_t i = 0; i < flat.positions.size(); ++i) flat.positions[i] = std::round(0.4 * flat.positions[i]);
    expect_same_distances(
        frames_of({flat, test::moved(flat, {0, 0, 1}), test::moved(flat, {0.5, 0, 0})}, seed, 3, 0, 0));
    expect_same_distances(frames_of({flat, test::moved(test::soup(random, 40, 1e-9), {0, 0, 0.5})}, seed, 3, 0.3, 0));
    expect_same_distances(frames_of({test::sphere(12, 1), test::sphere(12, 1)}, seed, 2, 0, 0));
  }
}

TEST_F(NearestOnDevice, WithThicknessPlanesAndFilters) {
  const std::vector<Body> bodies{test::sheet(14, 0.5), test::moved(test::sphere(12, 1), {3, 3, 1.5}),
                                 test::moved(test::sheet(9, 0.5), {1, 1, 0.4})};
  for (const unsigned seed : {1u, 2u}) {
    expect_same_distances(frames_of(bodies, seed, 3, 0.5, 0.02, [](Scene& scene) {
      scene.set_thickness(0, std::vector<double>{0.05});
      scene.set_thickness(2, std::vector<double>{0.02});
      scene.add_plane("floor", {{0, 0.1, 1}, -0.5});
    }));
    expect_same_distances(frames_of(bodies, seed, 3, 0.5, 0.02, [&](Scene& scene) {
      std::vector<double> each(bodies[1].faces.size() / 3);
      for (std::size_t i = 0; i < each.size(); ++i) each[i] = 0.01 * static_cast<double>(i * i % 37);
      scene.set_thickness(1, each);
    }));
    expect_same_distances(frames_of(bodies, seed, 3, 0.5, 0.02, [](Scene& scene) {
      scene.ignore_within(0, 2);
      scene.ignore_pair(0, 2);
      scene.ignore_faces(1, std::vector<std::uint32_t>{0, 1, 2, 3, 4, 5, 6, 7, 8}, 2);
    }));
  }
}

TEST_F(NearestOnDevice, OfManyWorlds) {
  const std::vector<Body> bodies{test::sheet(11, 0.5), test::moved(test::sphere(9, 1), {2, 2, 1.2}),
                                 test::moved(test::sphere(5, 0.2), {2, 2, 1.2})};
  expect_same_distances(frames_of(bodies, 1, 3, 0.4, 0.02, {}, 7));
}

TEST_F(NearestOnDevice, OfAVertexFarAway) {
  Body far = test::sheet(20, 1);
  far.positions[0] = 1e9;
  expect_same_distances(frames_of({far, test::moved(test::sheet(15, 1), {2, 2, 0.3})}, 1, 3, 0.1, 0.02), false);
}

// Meshes at poses.

struct Moving {
  Body body;
  bool is_static = false;
};

std::shared_ptr<Scene> scene_of_shapes(const std::vector<Moving>& meshes, bool self_collision = true) {
  auto scene = std::make_shared<Scene>();
  for (std::uint32_t i = 0; i < meshes.size(); ++i) {
    const Body& b = meshes[i].body;
    scene->add_mesh("body" + std::to_string(i), b.faces, static_cast<std::uint32_t>(b.positions.size() / 3),
                    {.self_collision = self_collision, .is_static = meshes[i].is_static, .points = b.points}, b.edges);
    scene->set_shape(i, b.positions);
  }
  return scene;
}

// by_poses: also that the device found them, and by poses: its search of positions counts pairs of nodes.
void expect_same_at_poses(const std::shared_ptr<const Scene>& scene, const std::vector<std::vector<Pose>>& frames,
                          bool by_poses = true) {
  Detector cpu(scene, {.backend = Backend::cpu}), gpu(scene, {.backend = Backend::gpu});
  for (const std::vector<Pose>& poses : frames) {
    const std::vector<Gap> found = gpu.distances_at(poses), expected = cpu.distances_at(poses);
    ASSERT_EQ(found.size(), expected.size());
    for (std::size_t i = 0; i < found.size(); ++i) expect_same(found[i], expected[i]);
    if (by_poses) {
      EXPECT_EQ(gpu.last_backend(), Backend::gpu) << gpu.last_gpu_error();
      EXPECT_EQ(gpu.stats().count("node_pairs"), 0u);
    }
    if (::testing::Test::HasFailure()) return;
  }
}

std::vector<std::vector<Pose>> random_frames(unsigned seed, std::size_t n_meshes, double reach, int n = 8) {
  Random random(seed);
  std::vector<std::vector<Pose>> frames;
  for (int frame = 0; frame < n; ++frame) {
    std::vector<Pose>& poses = frames.emplace_back();
    for (std::size_t m = 0; m < n_meshes; ++m) poses.push_back(test::random_pose(random, reach, frame % 4 != 0));
    if (frame % 3 == 2) frames.push_back(poses);
  }
  return frames;
}

TEST_F(NearestOnDevice, OfSolidsAtPosesApartTouchingNestedAndIntersecting) {
  for (const unsigned seed : {1u, 2u, 3u})
    for (const double reach : {0.1, 0.6, 1.0, 2.0, 30.0})
      expect_same_at_poses(scene_of_shapes({{test::sphere(24, 1)}, {test::sphere(17, 1)}, {test::sphere(6, 0.2)}}),
                           random_frames(seed, 3, reach));
}

TEST_F(NearestOnDevice, OfBodiesThatMoveSlowlyThroughEachOther) {
  const auto scene = scene_of_shapes({{test::sphere(30, 1), true}, {test::sphere(25, 1)}}, false);
  std::vector<std::vector<Pose>> frames;
  for (int i = 0; i < 60; ++i) {
    const double x = 2.2 - 0.012 * i, angle = 0.02 * i;
    frames.push_back({{{x, 0.1 * x, 0.02}, {0, std::sin(angle), 0, std::cos(angle)}}});
  }
  for (int i = 0; i < 30; ++i) frames.push_back(frames[static_cast<std::size_t>(59 - 2 * i)]);
  expect_same_at_poses(scene, frames);
}

TEST_F(NearestOnDevice, OfEveryKindOfMeshAtPoses) {
  for (const unsigned seed : {1u, 2u, 3u, 4u}) {
    Random random(seed);
    const auto scene = scene_of_shapes({{test::soup(random, 60, 0.4)},
                                        {test::rope(random, 40)},
                                        {test::points(random, 50)},
                                        {test::moved(test::soup(random, 5, 0.02), {1, 1, 3}), true},
                                        {test::rope(random, 3)},
                                        {test::with_isolated_vertices(test::sheet(6, 0.2), random, 9)},
                                        {test::sheet(30, 0.1)}});
    expect_same_at_poses(scene, random_frames(seed, 6, 1));
  }
  expect_same_at_poses(scene_of_shapes({{test::sheet(20, 1)}}), random_frames(1, 1, 1));
  expect_same_at_poses(scene_of_shapes({{test::sheet(2, 1)}}), random_frames(1, 1, 1));
  expect_same_at_poses(scene_of_shapes({{test::sphere(9, 1)}, {test::moved(test::sphere(9, 1), {2.5, 0, 0})}}), {{}});
  std::vector<Moving> many;
  for (int i = 0; i < 14; ++i) many.push_back({test::sphere(4, 0.3), i % 5 == 3});
  expect_same_at_poses(scene_of_shapes(many, false), random_frames(5, 11, 1));
}

TEST_F(NearestOnDevice, OfTinyHugeAndFarMeshesAtPoses) {
  expect_same_at_poses(scene_of_shapes({{test::sphere(12, 1e-3)}, {test::sphere(12, 0.02)}}, false),
                       random_frames(1, 2, 0.03));
  expect_same_at_poses(scene_of_shapes({{test::sphere(12, 200)}, {test::sphere(12, 1)}}, false),
                       random_frames(2, 2, 120), false);
  expect_same_at_poses(scene_of_shapes({{test::sphere(12, 1e-40)}, {test::sheet(9, 1e-41)}}),
                       random_frames(3, 2, 1e-40));
  expect_same_at_poses(scene_of_shapes({{test::sphere(12, 1e40)}, {test::sheet(9, 1e39)}}), random_frames(4, 2, 1e40));
  for (const double far : {1e3, 1e6, 1e9}) {
    const auto scene = scene_of_shapes(
        {{test::moved(test::sphere(9, 1), {far, 0, -far})}, {test::moved(test::sphere(7, 1), {far, 0, -far})}}, false);
    expect_same_at_poses(scene, random_frames(5, 2, 1), false);
    std::vector<std::vector<Pose>> still;
    for (int i = 0; i < 4; ++i) still.push_back({{{far, far, 0}}, {{far + 0.7 * i, far, 0.1}}});
    expect_same_at_poses(scene, still, false);
  }
}

TEST_F(NearestOnDevice, OfTiesAndTheSamePlacesAtPoses) {
  Body flat = test::sheet(12, 1);
  for (double& x : flat.positions) x = std::round(0.4 * x);
  const std::array<double, 4> quarter{0, 0, std::sqrt(0.5), std::sqrt(0.5)}, half{1, 0, 0, 0}, other{0.6, 0, 0, 0.8};
  for (const auto& turn : {std::array<double, 4>{0, 0, 0, 1}, quarter, half, other}) {
    std::vector<std::vector<Pose>> frames;
    for (const double z : {1.0, 0.0, 0.5, 2.0}) frames.push_back({{}, {{0, 0, z}, turn}, {{0.5, 0, 0}, turn}});
    expect_same_at_poses(scene_of_shapes({{flat}, {flat}, {flat}}), frames);
    const std::vector<Pose> same{{{0.1, 0.2, 0.3}, turn}, {{0.1, 0.2, 0.3}, turn}};
    expect_same_at_poses(scene_of_shapes({{test::sphere(12, 1)}, {test::sphere(12, 1)}}), {same, {{}, same[1]}, same});
  }
}

TEST_F(NearestOnDevice, AtPosesWithThicknessFiltersAndOtherQueries) {
  const auto scene = scene_of_shapes({{test::sheet(14, 0.5)}, {test::sphere(12, 1)}, {test::sheet(9, 0.5)}});
  scene->set_thickness(0, std::vector<double>{0.05});
  std::vector<double> each(test::sphere(12, 1).faces.size() / 3);
  for (std::size_t i = 0; i < each.size(); ++i) each[i] = 0.01 * static_cast<double>(i * i % 37);
  scene->set_thickness(1, each);
  scene->ignore_pair(0, 2);
  scene->ignore_faces(1, std::vector<std::uint32_t>{0, 1, 2, 3, 4, 5, 6, 7, 8}, 2);
  expect_same_at_poses(scene, random_frames(6, 3, 2));
  Detector gpu(scene, {.backend = Backend::gpu}), cpu(scene, {.backend = Backend::cpu});
  for (const std::vector<Pose>& poses : random_frames(7, 3, 1)) {
    const std::vector<double> x = cpu.positions_at(poses);
    const std::vector<Gap> expected = cpu.distances(Positions::of(x)), by_poses = gpu.distances_at(poses),
                           by_positions = gpu.distances(Positions::of(x));
    ASSERT_EQ(by_poses.size(), expected.size());
    for (std::size_t i = 0; i < expected.size(); ++i)
      expect_same(by_poses[i], expected[i]), expect_same(by_positions[i], expected[i]);
    EXPECT_EQ(gpu.intersections_at(poses).hash, cpu.intersections(Positions::of(x)).hash);
    if (HasFailure()) return;
  }
}

}  // namespace
}  // namespace hpccd
