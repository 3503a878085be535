// SPDX-License-Identifier: Apache-2.0
// Distances at rest against rationals: the least squared distance among all pairs of parts of two features.
#include "elementary/exact/distance.h"

#include <gtest/gtest.h>

#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <limits>

#include "random_features.h"

namespace hpccd::exact {
namespace {

using Rational = boost::multiprecision::cpp_rational;
using Point = std::array<Rational, 3>;

Point operator-(const Point& a, const Point& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Rational dot(const Point& a, const Point& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Rational least(const Rational& a, const Rational& b) { return b < a ? b : a; }

Rational to_segment(const Point& p, const Point& from, const Point& to) {
  const Point w = p - from, e = to - from;
  const Rational along = dot(w, e), length = dot(e, e);
  if (along <= 0) return dot(w, w);
  if (along >= length) return dot(p - to, p - to);
  return dot(w, w) - along * along / length;
}

// The least of |p - alpha a - beta b|^2 over all alpha, beta (by Cramer's rule on the normal equations), where `inside`
// accepts them; else nothing.
template <class Inside>
std::optional<Rational> in_plane(const Point& p, const Point& a, const Point& b, Inside&& inside) {
  const Rational aa = dot(a, a), ab = dot(a, b), bb = dot(b, b), det = aa * bb - ab * ab;
  if (det == 0) return {};
  const Rational alpha = (dot(p, a) * bb - dot(p, b) * ab) / det, beta = (dot(p, b) * aa - dot(p, a) * ab) / det;
  if (!inside(alpha, beta)) return {};
  Point rest;
  for (int k = 0; k < 3; ++k) rest[k] = p[k] - alpha * a[k] - beta * b[k];
  return dot(rest, rest);
}

Rational squared_distance(Kind kind, const Vec3<double> q[4]) {
  Point x[4];
  for (int i = 0; i < 4; ++i) x[i] = {Rational(q[i].x), Rational(q[i].y), Rational(q[i].z)};
  if (kind == Kind::vertex_face) {
    const auto inside = [](const Rational& u, const Rational& v) { return u >= 0 && v >= 0 && u + v <= 1; };
    const auto plane = in_plane(x[0] - x[1], x[2] - x[1], x[3] - x[1], inside);
    const Rational edges =
        least(to_segment(x[0], x[1], x[2]), least(to_segment(x[0], x[2], x[3]), to_segment(x[0], x[1], x[3])));
    return plane ? least(*plane, edges) : edges;
  }
  const auto inside = [](const Rational& u, const Rational& v) { return u >= 0 && u <= 1 && v <= 0 && v >= -1; };
  const auto lines = in_plane(x[2] - x[0], x[1] - x[0], x[3] - x[2], inside);
  const Rational ends = least(least(to_segment(x[0], x[2], x[3]), to_segment(x[1], x[2], x[3])),
                              least(to_segment(x[2], x[0], x[1]), to_segment(x[3], x[0], x[1])));
  return lines ? least(*lines, ends) : ends;
}

// Whether x is the root of `square`, off by one unit in the last place at most.
bool is_root(double x, const Rational& square) {
  if (x == 0) return square == 0;
  const Rational below(std::nextafter(x, 0)), above(std::nextafter(x, INFINITY));
  return below * below <= square && square <= above * above;
}

void expect_right(Kind kind, const Vec3<double> q[4], std::mt19937_64& random, double unit) {
  const Rational square = squared_distance(kind, q);
  const double d = distance(kind, q);
  ASSERT_TRUE(is_root(d, square)) << d;
  for (const double limit :
       {d, std::nextafter(d, INFINITY), d > 0 ? std::nextafter(d, 0) : 0.0, 0.0, unit * static_cast<int>(random() % 8)})
    ASSERT_EQ(within(kind, q, limit), square <= Rational(limit) * Rational(limit)) << limit;
  const Nearest near = nearest(kind, q);
  const Vec3<double> between = near.on_second - near.on_first;
  ASSERT_EQ(near.distance, d);
  ASSERT_NEAR(std::sqrt(hpccd::dot(between, between)) / unit, d / unit, 1e-14);
}

TEST(ExactDistance, IsThatOfRationals) {
  std::mt19937_64 random(5);
  for (int i = 0; i < 3000; ++i) {
    Vec3<double> q[4];
    random_points(random, i % 2 ? 2 : 5, 1, q);
    expect_right(random_kind(random), q, random, 1);
    ASSERT_FALSE(HasFailure()) << "query " << i;
  }
}

TEST(ExactDistance, KeepsItsBitsWithWideCoordinates) {
  std::mt19937_64 random(6);
  // One limb, two limbs, any size.
  for (const int lowest_bit : {-20, -90, -900})
    for (int i = 0; i < 300; ++i) {
      Vec3<double> q[4];
      random_points(random, 3, 1, q);
      for (auto& v : q) v.y += std::ldexp(static_cast<int>(random() % 3) - 1, lowest_bit) * (v.y == 0);
      expect_right(random_kind(random), q, random, 1);
      ASSERT_FALSE(HasFailure()) << "query " << i << ", lowest bit " << lowest_bit;
    }
}

TEST(ExactDistance, NeitherOverflowsNorUnderflows) {
  for (const double unit : {0x1p498, 0x1p-498, 0x1p-1074}) {
    const Vec3<double> q[4] = {{0, 0, 5 * unit}, {-2 * unit, -unit, 0}, {4 * unit, -unit, 0}, {0, 8 * unit, 0}};
    EXPECT_EQ(distance(Kind::vertex_face, q), 5 * unit);
    EXPECT_TRUE(within(Kind::vertex_face, q, 5 * unit));
    EXPECT_FALSE(within(Kind::vertex_face, q, 4 * unit));
    EXPECT_FALSE(within(Kind::vertex_face, q, 0));
  }
}

TEST(ExactDistance, IsZeroOnlyWhereTheFeaturesTouch) {
  const double unit = std::numeric_limits<double>::denorm_min();
  // A corner's height over a steep face, a third of the least number.
  const Vec3<double> q[4] = {{0, 0, 0}, {unit, 0, unit}, {-unit, unit, 0}, {0, -unit, 0}};
  EXPECT_EQ(distance(Kind::vertex_face, q), unit);
  EXPECT_FALSE(within(Kind::vertex_face, q, 0));
}

TEST(ExactDistance, NearestPointsOfParallelEdgesAreInTheMiddleOfTheirCommonStretch) {
  const Vec3<double> along[4] = {{0, 0, 0}, {4, 0, 0}, {2, 3, 0}, {10, 3, 0}};
  const Vec3<double> against[4] = {{0, 0, 0}, {4, 0, 0}, {10, 3, 0}, {2, 3, 0}};
  for (const auto* q : {along, against}) {
    const Nearest near = nearest(Kind::edge_edge, q);
    EXPECT_EQ(near.distance, 3);
    EXPECT_EQ(near.on_first.x, 3);
    EXPECT_EQ(near.on_first.y, 0);
    EXPECT_EQ(near.on_second.x, 3);
    EXPECT_EQ(near.on_second.y, 3);
  }
}

}  // namespace
}  // namespace hpccd::exact
