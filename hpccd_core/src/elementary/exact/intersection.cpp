// SPDX-License-Identifier: Apache-2.0
#include "elementary/exact/intersection.h"

#include "elementary/exact/boxes.h"
#include "elementary/exact/integers.h"
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

// The five points as integers. Each axis may have its own scale, which affects neither the signs below nor the order on
// a line.
//
// Bits, for coordinates of b bits: a difference has b + 1, a component of a cross product 2 b + 3, a volume 3 b + 6, a
// difference of volumes one more. All fit their types if b is at most Widths::coordinate_bits.
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

 private:
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
    int low = 2, high = 2;
    for (int i = 3; i < 5; ++i) {
      if (before(given_[i], given_[low])) low = i;
      if (before(given_[high], given_[i])) high = i;
    }
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

}  // namespace

bool intersect(const Vec3<double> q[5]) {
  if (boxes_apart(q)) return false;
  OddMantissa at[3][5];
  int low[3], bits = 1;
  for (int k = 0; k < 3; ++k) {
    BitRange range;
    for (int i = 0; i < 5; ++i) range.include(at[k][i] = OddMantissa(coordinate(q[i], k)));
    low[k] = range.low;
    bits = std::max(bits, range.bits());
  }
  if (bits <= Widths<Integer<1>>::coordinate_bits) return Points<Integer<1>>(q, at, low).intersect();
  if (bits <= Widths<Integer<2>>::coordinate_bits) return Points<Integer<2>>(q, at, low).intersect();
  return Points<Big>(q, at, low).intersect();
}

}  // namespace hpccd::exact
