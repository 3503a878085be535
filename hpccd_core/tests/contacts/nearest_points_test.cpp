// SPDX-License-Identifier: Apache-2.0
// Nearest points of two features: on both features, as far apart as the features, at the requested time.
#include "contacts/nearest_points.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "elementary/exact/distance.h"

namespace hpccd {
namespace {

using V = Vec3<double>;

UndecidedPair still(Kind kind, const V q[4]) {
  UndecidedPair pair{kind, {}, {}, 0};
  for (int i = 0; i < 4; ++i) pair.t0[i] = pair.t1[i] = q[i];
  return pair;
}

NearestPoints nearest_points(const UndecidedPair& pair, double time) {
  ByIntegers integers;
  return pair.kind == Kind::vertex_face ? hpccd::nearest_points<Kind::vertex_face>(pair.t0, pair.t1, time, integers)
                                        : hpccd::nearest_points<Kind::edge_edge>(pair.t0, pair.t1, time, integers);
}

double length(const V& v) { return std::hypot(v.x, v.y, v.z); }

// From a place to a feature: the vertex, the face, or an edge, as degenerate faces.
double away(Kind kind, const V q[4], bool from_second, const V& place) {
  const bool vf = kind == Kind::vertex_face;
  const V vertex[4] = {place, q[0], q[0], q[0]}, face[4] = {place, q[1], q[2], q[3]};
  const V a[4] = {place, q[0], q[1], q[1]}, b[4] = {place, q[2], q[3], q[3]};
  return exact::distance(Kind::vertex_face, from_second ? (vf ? face : b) : (vf ? vertex : a));
}

void expect_nearest(Kind kind, const V q[4], double size) {
  const NearestPoints found = nearest_points(still(kind, q), 0);
  const double distance = exact::distance(kind, q);
  EXPECT_NEAR(found.distance, distance, 1e-12 * size);
  EXPECT_NEAR(length(found.on_second - found.on_first), distance, 1e-12 * size);
  EXPECT_LE(away(kind, q, false, found.on_first), 1e-12 * size);
  EXPECT_LE(away(kind, q, true, found.on_second), 1e-12 * size);
  if (distance == 0) {
    EXPECT_EQ(found.distance, 0);
    EXPECT_EQ(length(found.direction), 0);
    return;
  }
  EXPECT_NEAR(length(found.direction), 1, 1e-14);
  if (distance < 1e-3 * size) return;
  const V across = kind == Kind::vertex_face ? found.on_first - found.on_second : found.on_second - found.on_first;
  EXPECT_LE(length((1 / distance) * across - found.direction), 1e-8) << "from the face, or from edge a";
}

class NearestPointsOf : public ::testing::TestWithParam<Kind> {};

TEST_P(NearestPointsOf, AreAsNearAsTheFeatures) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> real(-1, 1);
  for (int i = 0; i < 3000; ++i) {
    V q[4];
    for (V& p : q) p = {real(random), real(random), real(random)};
    // Nearly parallel edges and needles: the places are known badly, the distance is not.
    if (i % 3 == 1) q[3] = q[2] + (q[1] - q[0]) + std::ldexp(1.0, -static_cast<int>(random() % 60)) * V{1, 2, -1};
    expect_nearest(GetParam(), q, 3);
    ASSERT_FALSE(HasFailure()) << "query " << i;
  }
}

TEST_P(NearestPointsOf, DegenerateFeaturesOnALattice) {
  std::mt19937_64 random(4);
  int touching = 0;
  for (int i = 0; i < 3000; ++i) {
    V q[4];
    for (V& p : q)
      for (double* x : {&p.x, &p.y, &p.z}) *x = static_cast<int>(random() % 3) - 1;
    touching += exact::distance(GetParam(), q) == 0;
    expect_nearest(GetParam(), q, 1);
    ASSERT_FALSE(HasFailure()) << "query " << i;
  }
  EXPECT_GT(touching, 300);
}

TEST_P(NearestPointsOf, AtTheTimeAskedFor) {
  std::mt19937_64 random(5);
  for (int i = 0; i < 300; ++i) {
    UndecidedPair moving{GetParam(), {}, {}, 0};
    V now[4];
    for (int k = 0; k < 4; ++k) {
      for (V* p : {&moving.t0[k], &moving.t1[k]})
        for (double* x : {&p->x, &p->y, &p->z}) *x = static_cast<int>(random() % 65) - 32;
      now[k] = moving.t0[k] + 0.25 * (moving.t1[k] - moving.t0[k]);  // exact
    }
    const NearestPoints found = nearest_points(moving, 0.25), same = nearest_points(still(GetParam(), now), 0);
    EXPECT_EQ(found.distance, same.distance);
    EXPECT_EQ(length(found.on_first - same.on_first) + length(found.on_second - same.on_second), 0);
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, NearestPointsOf, ::testing::Values(Kind::vertex_face, Kind::edge_edge));

TEST(NearestPoints, OfParallelEdgesAreInTheMiddleOfTheStretchTheyShare) {
  const V q[4] = {{0, 0, 0}, {4, 0, 0}, {10, 3, 0}, {2, 3, 0}};
  const NearestPoints found = nearest_points(still(Kind::edge_edge, q), 0);
  EXPECT_EQ(found.distance, 3);
  EXPECT_EQ(found.on_first.x, 3);
  EXPECT_EQ(found.on_second.x, 3);
  EXPECT_EQ(found.direction.y, 1);
}

}  // namespace
}  // namespace hpccd
