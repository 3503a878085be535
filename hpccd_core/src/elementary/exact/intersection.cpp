// SPDX-License-Identifier: Apache-2.0
#include "elementary/exact/intersection.h"

#include <type_traits>

#include "elementary/exact/boxes.h"
#include "elementary/exact/integers.h"
#include "elementary/exact/nearest_place.h"
#include "elementary/exact/vector.h"

namespace hpccd::exact {
namespace {

// The index of a coordinate that is not zero, or 3.
template <class Z>
int nonzero(const Vector<Z>& v) {
  int k = 0;
  while (k < 3 && sign(v[k]) == 0) ++k;
  return k;
}
template <class Z>
bool parallel(const Vector<Z>& a, const Vector<Z>& b) {
  return nonzero(cross(a, b)) == 3;
}

// For points on a line: the order along it.
bool before(const Vec3<double>& a, const Vec3<double>& b) {
  return a.x != b.x ? a.x < b.x : a.y != b.y ? a.y < b.y : a.z < b.z;
}

// |x / y|, which is at most 1.
template <class X, class Y>
double part(const X& x, const Y& y) {
  return std::min(1.0, std::fabs(ratio(x, y)));
}

// The five points as integers. Each axis may have its own scale, which affects neither the signs below nor the order on
// a line.
//
// Bits, for coordinates of b bits: a difference has b + 1, a component of a cross product 2 b + 3, a volume 3 b + 6, a
// difference of volumes one more. Weights in a plane have 2 b + 5, their differences one more, and the sum of two
// products of such numbers 4 b + 13. All fit their types if b is at most Widths::coordinate_bits.
template <class Z>
class Points {
 public:
  Points(const Vec3<double> given[5], const OddMantissa at[3][5], const int low[3]) : given_(given) {
    for (int i = 0; i < 5; ++i)
      for (int k = 0; k < 3; ++k) q_[i][k] = scaled_integer<Z>(at[k][i], low[k]);
  }

  bool intersect() const {
    // From the face's first corner: to the others, and to the edge's ends.
    const Vector<Z> a = q_[3] - q_[2], b = q_[4] - q_[2], p = q_[0] - q_[2], r = q_[1] - q_[2];
    const auto n = cross(a, b);
    if (nonzero(n) == 3) return meets_collinear_face();
    const auto height_p = dot(p, n), height_r = dot(r, n);
    const int side_p = sign(height_p), side_r = sign(height_r);
    if (side_p * side_r > 0) return false;
    if (side_p == 0 && side_r == 0) return meets_in_plane(a, b, p, r, nonzero(n));
    // The edge's line meets the plane at the first corner + (alpha a + beta b) / d.
    const auto m = cross(p, r);
    const auto d = height_r - height_p, alpha = -dot(b, m), beta = dot(a, m);
    const int s = sign(d);
    return sign(alpha) * s >= 0 && sign(beta) * s >= 0 && sign(d - alpha - beta) * s >= 0;
  }

  IntersectionPlace place() const {
    const Vector<Z> a = q_[3] - q_[2], b = q_[4] - q_[2], p = q_[0] - q_[2], r = q_[1] - q_[2];
    const auto n = cross(a, b);
    if (nonzero(n) == 3) return place_on_collinear_face();
    const auto height_p = dot(p, n), height_r = dot(r, n);
    if (sign(height_p) == 0 && sign(height_r) == 0) return place_in_plane(a, b, p, r, nonzero(n));
    const auto m = cross(p, r);
    const auto d = height_r - height_p, alpha = -dot(b, m), beta = dot(a, m);
    IntersectionPlace place{};
    set_parameter(place, height_p, d);
    set_weight(place, 0, d - alpha - beta, d), set_weight(place, 1, alpha, d), set_weight(place, 2, beta, d);
    return place;
  }

 private:
  template <class X, class Y>
  static void set_parameter(IntersectionPlace& place, const X& x, const Y& y) {
    place.edge_parameter = part(x, y);
    if (sign(x) == 0) place.incidence |= IntersectionPlace::at_start;
    if (sign(x + y) == 0 || sign(x - y) == 0) place.incidence |= IntersectionPlace::at_end;
  }
  template <class X, class Y>
  static void set_weight(IntersectionPlace& place, int corner, const X& x, const Y& y) {
    place.weights[corner] = part(x, y);
    if (sign(x) == 0) place.incidence |= static_cast<std::uint8_t>(IntersectionPlace::without_corner << corner);
  }

  // The weights are linear along the edge, which enters the face where the last negative one becomes 0.
  static IntersectionPlace place_in_plane(const Vector<Z>& a, const Vector<Z>& b, const Vector<Z>& p,
                                          const Vector<Z>& r, int k) {
    const auto cross_ab = cross(a, b, k);
    using Area = std::decay_t<decltype(cross_ab)>;
    const bool negative = sign(cross_ab) < 0;
    const auto weights = [&](const Vector<Z>& x) {
      const Area n = cross_ab, alpha = cross(x, b, k), beta = cross(a, x, k), gamma = n - alpha - beta;
      return negative ? std::array<Area, 3>{-gamma, -alpha, -beta} : std::array<Area, 3>{gamma, alpha, beta};
    };
    const auto at_p = weights(p), at_r = weights(r);
    Area x(0), y(1);
    for (int i = 0; i < 3; ++i) {
      if (sign(at_p[i]) >= 0) continue;
      const Area x_i = -at_p[i], y_i = at_r[i] - at_p[i];
      if (sign(x_i * y - x * y_i) > 0) x = x_i, y = y_i;
    }
    IntersectionPlace place{0, {}, IntersectionPlace::in_plane};
    set_parameter(place, x, y);
    for (int i = 0; i < 3; ++i) set_weight(place, i, at_p[i] * y + x * (at_r[i] - at_p[i]), cross_ab * y);
    return place;
  }

  struct Outermost {
    int low = 2, high = 2;
  };
  // Of a collinear face.
  Outermost outermost_corners() const {
    Outermost of;
    for (int i = 3; i < 5; ++i) {
      if (before(given_[i], given_[of.low])) of.low = i;
      if (before(given_[of.high], given_[i])) of.high = i;
    }
    return of;
  }

  IntersectionPlace place_on_collinear_face() const {
    const auto [low, high] = outermost_corners();
    const Vector<Z> a = q_[1] - q_[0], b = q_[high] - q_[low], p = q_[low] - q_[0];
    IntersectionPlace place{0, {}, IntersectionPlace::in_plane | 7 * IntersectionPlace::without_corner};
    // At the edge's x / y and at the face's u / w, from low to high.
    const auto set = [&](const auto& x, const auto& y, const auto& u, const auto& w) {
      set_parameter(place, x, y);
      place.incidence &= static_cast<std::uint8_t>(~(IntersectionPlace::without_corner << (low - 2)));
      if (low != high) {
        place.incidence &= static_cast<std::uint8_t>(~(IntersectionPlace::without_corner << (high - 2)));
        set_weight(place, high - 2, u, w);
      }
      // Both have the same sign.
      set_weight(place, low - 2, w - u, w);
    };
    const auto n = cross(a, b);
    if (const int k = nonzero(n); k < 3) {
      const auto x = cross(p, b, k), u = cross(p, a, k);
      set(x, n[k], u, n[k]);
      return place;
    }
    const int along_a = nonzero(a), along_b = nonzero(b);
    const Z none(0), one(1);
    const bool starts_inside = !before(given_[0], given_[low]) && !before(given_[high], given_[0]);
    if (along_a == 3 || starts_inside) {
      if (along_b == 3)
        set(none, one, none, one);
      else
        set(none, one, q_[0][along_b] - q_[low][along_b], b[along_b]);
      return place;
    }
    const bool at_low = low == high || before(given_[0], given_[low]);
    const int end = at_low ? low : high;
    set(q_[end][along_a] - q_[0][along_a], a[along_a], at_low ? none : one, one);
    return place;
  }

  // Both in one plane, projected along an axis k along which the face has an area: they are apart if one of the four
  // lines of their sides has the other figure beyond it. An edge that is a point has no such line, and its signs are 0.
  static bool meets_in_plane(const Vector<Z>& a, const Vector<Z>& b, const Vector<Z>& p, const Vector<Z>& r, int k) {
    const auto n = cross(a, b, k), m = cross(p, r, k);
    const auto alpha_p = cross(p, b, k), alpha_r = cross(r, b, k), beta_p = cross(a, p, k), beta_r = cross(a, r, k);
    const int s = sign(n);
    const auto beyond = [s](const auto& x, const auto& y) { return sign(x) * s < 0 && sign(y) * s < 0; };
    if (beyond(alpha_p, alpha_r) || beyond(beta_p, beta_r) || beyond(n - alpha_p - beta_p, n - alpha_r - beta_r))
      return false;
    // On which side of the edge each corner lies.
    const int side = sign(m);
    return side == 0 || sign(m + beta_p - beta_r) != side || sign(m + alpha_r - alpha_p) != side;
  }

  // The face is the segment between its outermost corners.
  bool meets_collinear_face() const {
    const auto [low, high] = outermost_corners();
    const Vector<Z> a = q_[1] - q_[0], b = q_[high] - q_[low], p = q_[low] - q_[0];
    const auto n = cross(a, b);
    if (const int k = nonzero(n); k < 3) {
      if (sign(dot(p, n)) != 0) return false;
      const int s = sign(n[k]);
      const auto between = [&](const auto& x) { return sign(x) * s >= 0 && sign(n[k] - x) * s >= 0; };
      return between(cross(p, b, k)) && between(cross(p, a, k));
    }
    if (!parallel(p, a) || !parallel(p, b)) return false;
    const bool forward = !before(given_[1], given_[0]);
    return !before(given_[high], given_[forward ? 0 : 1]) && !before(given_[forward ? 1 : 0], given_[low]);
  }

  const Vec3<double>* given_;
  Vector<Z> q_[5];
};

bool boxes_apart(const Vec3<double> q[5]) {
  for (int k = 0; k < 3; ++k) {
    const auto edge = std::minmax({coordinate(q[0], k), coordinate(q[1], k)});
    const auto face = std::minmax({coordinate(q[2], k), coordinate(q[3], k), coordinate(q[4], k)});
    if (edge.second < face.first || face.second < edge.first) return true;
  }
  return false;
}

// use(points), with the narrowest integers that hold them.
template <class Use>
auto with_points(const Vec3<double> q[5], Use&& use) {
  OddMantissa at[3][5];
  int low[3], bits = 1;
  for (int k = 0; k < 3; ++k) {
    BitRange range;
    for (int i = 0; i < 5; ++i) range.include(at[k][i] = OddMantissa(coordinate(q[i], k)));
    low[k] = range.low;
    bits = std::max(bits, range.bits());
  }
  if (bits <= Widths<Integer<1>>::coordinate_bits) return use(Points<Integer<1>>(q, at, low));
  if (bits <= Widths<Integer<2>>::coordinate_bits) return use(Points<Integer<2>>(q, at, low));
  return use(Points<Big>(q, at, low));
}

}  // namespace

bool intersect(const Vec3<double> q[5]) {
  return !boxes_apart(q) && with_points(q, [](const auto& points) { return points.intersect(); });
}

IntersectionPlace place_of_intersection(const Vec3<double> q[5]) {
  return with_points(q, [](const auto& points) { return points.place(); });
}

}  // namespace hpccd::exact
