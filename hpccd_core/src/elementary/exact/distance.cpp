// SPDX-License-Identifier: Apache-2.0
#include "elementary/exact/distance.h"

#include "elementary/exact/nearest_place.h"
#include "elementary/exact/scaled.h"

namespace hpccd::exact {
namespace {

template <class Z>
Resting<Z> resting(Kind kind, const Given& given, int low) {
  Resting<Z> r;
  r.kind = kind;
  for (int i = 0; i < 4; ++i)
    for (int k = 0; k < 3; ++k) r.q[i][k] = scaled_integer<Z>(given.x[i][k], low);
  return r;
}

// Calls f with the features in the smallest sufficient integers.
template <class F>
auto in_integers(Kind kind, const Vec3<double> q[4], F&& f) {
  const Given given(q);
  const int bits = given.range.bits(), low = given.range.low;
  if (bits <= Widths<Integer<1>>::coordinate_bits) return f(resting<Integer<1>>(kind, given, low), low);
  if (bits <= Widths<Integer<2>>::coordinate_bits) return f(resting<Integer<2>>(kind, given, low), low);
  return f(resting<Big>(kind, given, low), low);
}

// Whether num / den <= d^2.
template <class Z>
struct Compare {
  static constexpr int room = 3;  // limbs between the scales of d^2 and of the squared coordinates
  Margin d;
  bool found = false;

  static bool fits(const Margin& d) { return std::abs(2 * d.shift) <= 64 * room; }

  template <class N, class D>
  bool not_above(const N& num, const D& den) const {
    const Z m(d.mantissa);
    const auto limit = Z(d.mantissa) * m * den;
    if (d.shift <= 0) return sign(limit - shifted<room>(num, -2 * d.shift)) >= 0;
    return sign(shifted<room>(limit, 2 * d.shift) - num) >= 0;
  }
  template <class N, class D>
  bool planes(const N& num, const D& den, const D&, const D&) {
    return !(found = not_above(num, den));
  }
  template <class N, class D>
  bool line(const N& num, const D& den, const D&, int) {
    return !(found = not_above(num, den));
  }
  template <class N>
  bool points(const N& num, int, int) {
    return !(found = not_above(num, Z(1)));
  }
};

template <class Z>
bool within(const Resting<Z>& features, const Margin& d) {
  Compare<Z> compare{d};
  features.for_nearest(compare);
  return compare.found;
}

Vec3<double> between(const Vec3<double>& from, const Vec3<double>& to, double t) {
  return t == 1 ? to : from + t * (to - from);
}

Nearest points_at(Kind kind, const Vec3<double> q[4], const Place& place) {
  const bool inside = place.where == Place::inside;
  if (inside && kind == Kind::vertex_face)
    return {0, q[0], q[1] + (place.alpha * (q[2] - q[1]) + place.beta * (q[3] - q[1]))};
  if (inside) return {0, between(q[0], q[1], place.alpha), between(q[2], q[3], -place.beta)};
  const auto [point, from, to] = point_segments[kind == Kind::edge_edge][place.segment];
  const Vec3<double> foot = between(q[from], q[to], place.along);
  if (kind == Kind::vertex_face || point < 2) return {0, q[point], foot};
  return {0, foot, q[point]};
}

// For parallel edges side by side: positions on both in the middle of the common stretch.
template <class Z>
bool middle_of_common_stretch(const Resting<Z>& edges, bool parallel, double& on_a, double& on_b) {
  const auto [p, a, b] = edges.spanned();
  const auto length = dot(a, a);
  if (sign(length) == 0) return false;
  if (!parallel) {
    const auto n = cross(a, b);
    if (sign(dot(n, n)) != 0) return false;
  }
  const auto b0 = dot(p, a), b1 = dot(edges.q[3] - edges.q[0], a), turn = b1 - b0;
  if (sign(turn) == 0) return false;  // b is a point
  const auto least = [](const auto& x, const auto& y) { return sign(y - x) < 0 ? y : x; };
  const auto most = [](const auto& x, const auto& y) { return sign(y - x) < 0 ? x : y; };
  const auto from = most(decltype(length)(0), least(b0, b1)), to = least(length, most(b0, b1));
  if (sign(to - from) < 0) return false;
  on_a = ratio(from + to, length + length);
  const auto along_b = from + to - b0 - b0;
  on_b = sign(turn) > 0 ? ratio(along_b, turn + turn) : ratio(-along_b, -turn - turn);
  return true;
}

}  // namespace

bool within(Kind kind, const Vec3<double> q[4], double d) {
  const Given given(q);
  const int bits = given.range.bits(), low = given.range.low;
  const Margin margin(d, low);
  const bool small = Compare<Big>::fits(margin);
  if (small && bits <= Widths<Integer<1>>::coordinate_bits)
    return within(resting<Integer<1>>(kind, given, low), margin);
  if (small && bits <= Widths<Integer<2>>::coordinate_bits)
    return within(resting<Integer<2>>(kind, given, low), margin);
  return within(resting<Big>(kind, given, low), margin);
}

double distance(Kind kind, const Vec3<double> q[4]) {
  return in_integers(kind, q, [&]<class Z>(const Resting<Z>& features, int low) {
    Least<Z> least;
    features.for_nearest(least);
    return least.distance(low);
  });
}

Nearest nearest(Kind kind, const Vec3<double> q[4], bool parallel) {
  return in_integers(kind, q, [&]<class Z>(const Resting<Z>& features, int low) {
    Least<Z> least;
    features.for_nearest(least);
    double on_a = 0, on_b = 0;
    Nearest found = kind == Kind::edge_edge && middle_of_common_stretch(features, parallel, on_a, on_b)
                        ? Nearest{0, between(q[0], q[1], on_a), between(q[2], q[3], on_b)}
                        : points_at(kind, q, least.place);
    found.distance = least.distance(low);
    return found;
  });
}

}  // namespace hpccd::exact
