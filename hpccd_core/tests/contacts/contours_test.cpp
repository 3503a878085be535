// SPDX-License-Identifier: Apache-2.0
// Intersection curves through the public interface.
#include "hpccd/contours.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "hpccd/hpccd.h"

namespace hpccd {
namespace {

// A pyramid, whose tip points down, over a square of two triangles.
struct PyramidInSquare {
  std::shared_ptr<Scene> scene = std::make_shared<Scene>();
  std::vector<double> xyz = {-2, -2, 1, 2, -2, 1, 2, 2, 1, -2, 2, 1, 0.1, 0.2, -1,  // pyramid
                             -3, -3, 0, 3, -3, 0, 3, 3, 0, -3, 3, 0};

  PyramidInSquare() {
    const std::vector<std::uint32_t> pyramid = {0, 4, 1, 1, 4, 2, 2, 4, 3, 3, 4, 0}, square = {0, 1, 2, 0, 2, 3};
    scene->add_mesh("pyramid", pyramid, 5, {});
    scene->add_mesh("square", square, 4, {});
  }
  Intersections found(bool points, bool directions = false) const {
    Options options;
    options.points = points, options.directions = directions, options.backend = Backend::cpu, options.threads = 1;
    return Detector(scene, options).intersections(Positions::of(std::span(xyz)));
  }
};

TEST(Contours, ARingEnclosesTheTip) {
  const PyramidInSquare given;
  const Intersections found = given.found(true, true);
  EXPECT_EQ(found.hash, given.found(false).hash);
  EXPECT_EQ(found.directions.size(), found.ef.size());
  const std::vector<Contour> curves = contours(*given.scene, found);
  ASSERT_EQ(curves.size(), 1u);
  EXPECT_TRUE(curves[0].closed);
  EXPECT_EQ(curves[0].mesh_a, 0u);
  EXPECT_EQ(curves[0].mesh_b, 1u);
  std::vector<std::uint32_t> rows = curves[0].rows;
  EXPECT_EQ(rows[0], 0u);
  std::ranges::sort(rows);
  ASSERT_EQ(rows.size(), found.ef.size());
  for (std::uint32_t i = 0; i < rows.size(); ++i) EXPECT_EQ(rows[i], i);
  for (const auto& point : found.points) EXPECT_EQ(point[2], 0);
  const std::vector<EnclosedRegion> regions = enclosed_regions(*given.scene, found);
  ASSERT_EQ(regions.size(), 1u);
  EXPECT_EQ(regions[0].vertices_a, (std::vector<std::uint32_t>{4}));
  EXPECT_TRUE(regions[0].vertices_b.empty()) << "it passes between the vertices of the square";
}

TEST(Contours, NeedPointsAndTheirScene) {
  const PyramidInSquare given;
  EXPECT_THROW(contours(*given.scene, given.found(false)), InvalidArgument);
  EXPECT_THROW(enclosed_regions(Scene(), given.found(true)), InvalidArgument);
  EXPECT_TRUE(contours(Scene(), {}).empty());
}

}  // namespace
}  // namespace hpccd
