// SPDX-License-Identifier: Apache-2.0
#include "rigid/placed_vertices.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "hpccd/errors.h"

namespace hpccd::rigid {
namespace {

const Pose half_turn{{0, 0, 1, 0}, {1, 2, 3}};  // about z

std::vector<Vector> placed(const std::vector<Pose>& poses, const std::vector<LinkMesh>& meshes,
                           const std::vector<Vector>& vertices) {
  std::vector<Vector> found(vertices.size());
  place_vertices(poses, meshes, vertices, found);
  return found;
}

void expect_equal(const Vector& found, const Vector& expected) {
  EXPECT_EQ(found.x, expected.x);
  EXPECT_EQ(found.y, expected.y);
  EXPECT_EQ(found.z, expected.z);
}

TEST(PlacedVertices, EachMeshGoesWithItsLink) {
  const Pose shifted{{}, {10, 0, 0}};
  const auto found = placed({shifted, half_turn}, {{1, 1}, {0, 1}, {0, 3}}, {{1, 1, 1}, {1, 1, 1}, {2, 0, 0}});
  expect_equal(found[0], {0, 1, 4});
  expect_equal(found[1], {11, 1, 1});  // the mesh between has no vertices
  expect_equal(found[2], {12, 0, 0});
}

TEST(PlacedVertices, WithoutAMotionZerosKeepTheirSign) {
  EXPECT_TRUE(std::signbit(placed({{}}, {{0, 1}}, {{-0.0, 1, 2}})[0].x));
  EXPECT_FALSE(std::signbit(placed({half_turn}, {{0, 1}}, {{1, 1, 2}})[0].x));
}

TEST(PlacedVertices, MayBeNone) {
  EXPECT_TRUE(placed({}, {}, {}).empty());
  EXPECT_TRUE(placed({half_turn}, {{0, 0}}, {}).empty());
}

TEST(PlacedVertices, RefusesWhatDoesNotFitTogether) {
  EXPECT_THROW(placed({half_turn}, {{1, 1}}, {{0, 0, 0}}), InvalidArgument);
  EXPECT_THROW(placed({half_turn}, {}, {{0, 0, 0}}), InvalidArgument);
  EXPECT_THROW(placed({half_turn}, {{0, 2}}, {{0, 0, 0}}), InvalidArgument);
  EXPECT_THROW(placed({half_turn}, {{0, 1}, {0, 0}}, {{0, 0, 0}}), InvalidArgument);
}

}  // namespace
}  // namespace hpccd::rigid
