// SPDX-License-Identifier: Apache-2.0
// Queries by poses through the public C++ interface: those of the positions, on any number of threads.
#include <gtest/gtest.h>

#include <cmath>

#include "grid_scene.h"
#include "hpccd/hpccd.h"

namespace hpccd {
namespace {

constexpr std::uint32_t side = 30;

std::shared_ptr<Scene> sheets_with_shapes() {
  auto scene = std::make_shared<Scene>(*test::two_sheets(side));
  const std::vector<double> x = test::sheet_positions(side, 0);
  for (std::uint32_t m = 0; m < 2; ++m) scene->set_shape(m, std::span(x).subspan(x.size() / 2 * m, x.size() / 2));
  return scene;
}

std::vector<Pose> poses_at(double t) {
  const double angle = 0.1 * t;
  return {{}, {{0.1 * t, 0, 0.3 - 0.2 * t}, {0, 0, std::sin(angle), std::cos(angle)}}};
}

TEST(Poses, GiveTheResultsOfThePositions) {
  const auto scene = sheets_with_shapes();
  for (const int threads : {1, 4}) {
    Options options;
    options.backend = Backend::cpu, options.threads = threads, options.points = true;
    Detector by_poses(scene, options), by_positions(scene, options);
    std::size_t n_hits = 0;
    for (const double t : {0.0, 1.0, 1.5, 4.0, 4.0}) {
      const std::vector<Pose> poses = poses_at(t);
      const std::vector<double> x = by_positions.positions_at(poses);
      const Positions positions = Positions::of(x);
      const Intersections hits = by_poses.intersections_at(poses), expected = by_positions.intersections(positions);
      EXPECT_EQ(hits.ef, expected.ef);
      EXPECT_EQ(hits.points, expected.points);
      EXPECT_EQ(hits.hash, expected.hash);
      n_hits += hits.ef.size();
      EXPECT_EQ(by_poses.proximity_at(poses, 0.1).hash, by_positions.proximity(positions, 0.1).hash);
      const std::vector<Gap> gaps = by_poses.distances_at(poses), others = by_positions.distances(positions);
      ASSERT_EQ(gaps.size(), others.size());
      for (std::size_t i = 0; i < gaps.size(); ++i) {
        EXPECT_EQ(gaps[i].distance, others[i].distance);
        EXPECT_EQ(gaps[i].features, others[i].features);
        EXPECT_EQ(gaps[i].points, others[i].points);
      }
    }
    EXPECT_GT(n_hits, 0u);
  }
}

TEST(Poses, OfMeshesWithoutAShapeAreRejected) {
  Detector detector(test::two_sheets(side), {});
  const std::vector<double> x = test::sheet_positions(side, 0);
  EXPECT_THROW(detector.distances_at({}), InvalidArgument);
  EXPECT_THROW(detector.distances_at(poses_at(0), Positions::of(x)), InvalidArgument);
  EXPECT_EQ(detector.distances_at({}, Positions::of(x)).size(), detector.distances(Positions::of(x)).size());
}

}  // namespace
}  // namespace hpccd
