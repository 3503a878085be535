// SPDX-License-Identifier: Apache-2.0
// When features come within a distance: against distances at rest at exact times, and by construction.
#include "elementary/exact/separation.h"

#include <gtest/gtest.h>

#include <cmath>

#include "elementary/exact/distance.h"
#include "random_features.h"

namespace hpccd::exact {
namespace {

struct Motion4 {
  Vec3<double> t0[4], t1[4];
  // Exact where the coordinates are multiples of what divides t.
  void at(double t, Vec3<double> q[4]) const {
    for (int i = 0; i < 4; ++i) q[i] = t0[i] + t * (t1[i] - t0[i]);
  }
};

std::optional<double> earliest(Kind kind, const Motion4& m, double d) { return earliest_within(kind, m.t0, m.t1, d); }

TEST(ExactSeparation, IsNotLaterThanAnyTimeAtWhichTheFeaturesAreNear) {
  std::mt19937_64 random(1);
  constexpr int parts = 64;
  int n_later = 0, n_never = 0;
  for (int i = 0; i < 2000; ++i) {
    Motion4 m;
    const int most = i % 2 ? 2 : 6;
    random_points(random, most, parts, m.t0);
    random_points(random, most, parts, m.t1);
    const Kind kind = random_kind(random);
    const double d = parts / 4 * static_cast<double>(1 + random() % 8);
    const auto toc = earliest(kind, m, d);
    n_later += toc > 0.0, n_never += !toc;
    for (int k = 0; k <= parts; ++k) {
      const double t = static_cast<double>(k) / parts;
      Vec3<double> q[4];
      m.at(t, q);
      const bool near = within(kind, q, d);
      ASSERT_FALSE(near && toc.value_or(INFINITY) > t) << "query " << i << ", time " << t;
      if (k == 0) ASSERT_EQ(near, toc == 0.0) << "query " << i;
      if (near) break;
    }
  }
  EXPECT_GT(n_later, 300);
  EXPECT_GT(n_never, 300);
}

TEST(ExactSeparation, IsTheTimeAtWhichTheDistanceIsReached) {
  std::mt19937_64 random(2);
  int n = 0;
  for (int i = 0; i < 2000; ++i) {
    Motion4 m;
    random_points(random, 5, 1, m.t0);
    random_points(random, 5, 1, m.t1);
    const Kind kind = random_kind(random);
    const double d = std::ldexp(static_cast<double>(random() >> 11), -53);
    const auto toc = earliest(kind, m, d);
    if (!toc || *toc == 0) continue;
    ++n;
    Vec3<double> q[4];
    m.at(*toc, q);
    ASSERT_NEAR(distance(kind, q), d, 1e-14) << "query " << i;
  }
  EXPECT_GT(n, 300);
}

// A vertex passes over a corner, an edge and the inside of a face on the line y = height / 2.
Motion4 pass(double x, double height) {
  return {{{-4, x, height}, {0, 0, 0}, {2, 0, 0}, {0, 2, 0}}, {{4, x, height}, {0, 0, 0}, {2, 0, 0}, {0, 2, 0}}};
}

TEST(ExactSeparation, CountsGrazing) {
  // Nearest at the corner: a double root of |p - v|^2 - d^2, at x = 0.
  EXPECT_EQ(earliest(Kind::vertex_face, pass(-3, 4), 5), 0.5);
  EXPECT_EQ(earliest(Kind::vertex_face, pass(-3, 4), std::nextafter(5, 0)), std::nullopt);
  const auto just_before = earliest(Kind::vertex_face, pass(-3, 4), std::nextafter(5, 6));
  ASSERT_TRUE(just_before);
  EXPECT_LT(*just_before, 0.5);
  EXPECT_NEAR(*just_before, 0.5, 1e-7);
  // Nearest inside a face that turns: with s = 2 t - 1, at a distance of sqrt(1 + s^2).
  const Motion4 turning{{{0, 1, 1}, {-2, -1, 1}, {2, -1, 1}, {0, 2, -2}},
                        {{0, -1, 1}, {-2, -1, -1}, {2, -1, -1}, {0, 2, 2}}};
  EXPECT_EQ(earliest(Kind::vertex_face, turning, 1), 0.5);
  EXPECT_EQ(earliest(Kind::vertex_face, turning, std::nextafter(1, 0)), std::nullopt);
  EXPECT_NEAR(earliest(Kind::vertex_face, turning, std::nextafter(1, 2)).value_or(0), 0.5, 1e-7);
}

TEST(ExactSeparation, ComesOfPartsThatDifferInDimension) {
  // Over the inside at d exactly from an edge on: plane and vertex slide at distance d, which gives no time; the edge
  // does.
  EXPECT_EQ(earliest(Kind::vertex_face, pass(1, 1), 1), 0.5);
  EXPECT_EQ(earliest(Kind::vertex_face, pass(1, 1), std::nextafter(1, 0)), std::nullopt);
  // Along an edge's line at distance d, until beside its end.
  EXPECT_EQ(earliest(Kind::vertex_face, pass(0, 1), 1), 0.5);
  EXPECT_EQ(earliest(Kind::vertex_face, pass(-1, 0), 1), 0.5);
  // Distance d at the start, and later ever more.
  Motion4 leaving = pass(0, 1);
  leaving.t0[0] = {0.5, 0.5, 1}, leaving.t1[0] = {0.5, 0.5, 9};
  EXPECT_EQ(earliest(Kind::vertex_face, leaving, 1), 0.0);
  // Distance d at the end for the first time.
  std::swap(leaving.t0[0], leaving.t1[0]);
  EXPECT_EQ(earliest(Kind::vertex_face, leaving, 1), 1.0);
  EXPECT_EQ(earliest(Kind::vertex_face, leaving, std::nextafter(1, 0)), std::nullopt);
}

TEST(ExactSeparation, KnowsParallelEdgesAndDegenerateFeatures) {
  Motion4 m{{{0, 0, 0}, {4, 0, 0}, {1, 5, 0}, {9, 5, 0}}, {{0, 0, 0}, {4, 0, 0}, {1, 1, 0}, {9, 1, 0}}};
  EXPECT_EQ(earliest(Kind::edge_edge, m, 3), 0.5);
  m.t0[3] = m.t0[2], m.t1[3] = m.t1[2];  // a point
  EXPECT_EQ(earliest(Kind::edge_edge, m, 3), 0.5);
  m.t0[1] = m.t1[1] = {0, 0, 0}, m.t0[2] = m.t0[3] = {0, 5, 0}, m.t1[2] = m.t1[3] = {0, 1, 0};  // two points
  EXPECT_EQ(earliest(Kind::edge_edge, m, 3), 0.5);
  m.t0[3] = m.t1[3] = m.t0[2] = m.t1[2] = {0, 0, 0}, m.t0[0] = {3, 4, 0},
  m.t1[0] = {0, 0, 0};  // a face that is a point
  EXPECT_EQ(earliest(Kind::vertex_face, m, 2.5), 0.5);
  // The face collapses for a moment while the vertex is far: there the plane has no distance.
  const Motion4 collapsing{{{0, 9, 1}, {-1, -1, 0}, {1, -1, 0}, {0, 1, 0}},
                           {{0, 9, 1}, {1, 1, 0}, {-1, 1, 0}, {0, -1, 0}}};
  EXPECT_EQ(earliest(Kind::vertex_face, collapsing, 0.5), std::nullopt);
}

TEST(ExactSeparation, IsTheSameAtEveryScale) {
  std::mt19937_64 random(3);
  for (int i = 0; i < 300; ++i) {
    Motion4 m;
    random_points(random, 4, 1, m.t0);
    random_points(random, 4, 1, m.t1);
    const Kind kind = random_kind(random);
    const double d = 0.25 * static_cast<double>(1 + random() % 5);
    const auto toc = earliest(kind, m, d);
    for (const int exponent : {490, -490, -1070}) {
      const double unit = std::ldexp(1, exponent);
      Motion4 s = m;
      for (auto* q : {s.t0, s.t1})
        for (int k = 0; k < 4; ++k) q[k] = unit * q[k];
      ASSERT_EQ(earliest(kind, s, unit * d), toc) << "query " << i << ", scale " << unit;
    }
  }
}

TEST(ExactSeparation, FindsRootsThatAreHugeOrdersOfMagnitudeApart) {
  // Comes within d at 2^-1000 of the step and leaves it soon after.
  const double far = 0x1p498, d = 0x1p-503;
  const Motion4 flyby{{{-0x1p-502, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}},
                      {{far, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}}};
  EXPECT_EQ(earliest(Kind::vertex_face, flyby, d), 0.0);
  Motion4 aside = flyby;
  aside.t0[0].y = aside.t1[0].y = d;  // grazes
  EXPECT_EQ(earliest(Kind::vertex_face, aside, d), 0.0);
  aside.t0[0].y = aside.t1[0].y = std::nextafter(d, 1);
  EXPECT_EQ(earliest(Kind::vertex_face, aside, d), std::nullopt);
}

}  // namespace
}  // namespace hpccd::exact
