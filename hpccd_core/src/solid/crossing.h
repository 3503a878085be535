// SPDX-License-Identifier: Apache-2.0
// How the ray from a point along +x crosses a triangle, as a floating-point filter. On CPUs and devices.
#pragma once

#include <math.h>

#include "base/vec3.h"

namespace hpccd {

// `turn` is 1 if the corners are counterclockwise seen against the ray's direction, -1 if clockwise, 0 without a
// crossing of the ray's line. `ahead`: sign of the crossing's x minus that of the point; 0: the point is on the
// triangle, or may be on it if there is no crossing.
//
// The line never meets an edge or a vertex: the point counts as moved by (eps, eps^2) along y and z, with an
// infinitesimal eps (Edelsbrunner and Muecke 1990). An orientation in the plane of y and z that is zero then has the
// sign of its derivative with respect to the point's y, or else to its z. The two faces of an edge see it alike.
struct Crossing {
  int turn, ahead;
  bool certain = true;
};

HPCCD_HD int sign_of(double x) { return (x > 0) - (x < 0); }

// q: the point and three corners. Certain by error bounds (Shewchuk 1997): with u = 2^-53, an orientation in the plane
// is computed from rounded differences within (3 + 16 u) u of the sum of its products' magnitudes, a volume within (7 +
// 56 u) u. Products that underflow add less than `least` each, times a coordinate in a volume. An overflow makes a
// comparison false.
HPCCD_HOST_DEVICE inline Crossing crossing(const Vec3<double> q[4]) {
  constexpr double in_plane = 3.4e-16, in_space = 7.8e-16, least = 2.3e-308;
  const Vec3<double> a = q[1] - q[0], b = q[2] - q[0], c = q[3] - q[0];
  double orientation[3], size[3];
  int turn = 0;
  bool certain = true;
  const auto orient = [&](int i, const Vec3<double>& from, const Vec3<double>& to) {
    const double left = from.y * to.z, right = from.z * to.y;
    orientation[i] = left - right, size[i] = fabs(left) + fabs(right);
    if (!(fabs(orientation[i]) > in_plane * size[i] + least)) {
      certain = false;
      return true;
    }
    const int s = sign_of(orientation[i]);
    const bool outside = s == -turn;
    turn = s;
    return !outside;
  };
  if (!orient(0, a, b) || !orient(1, b, c) || !orient(2, c, a)) return {0, 1};  // strictly outside in the plane
  if (!certain) return {0, 0, false};
  if (a.x > 0 && b.x > 0 && c.x > 0) return {turn, 1};
  if (a.x < 0 && b.x < 0 && c.x < 0) return {turn, -1};
  const double volume = a.x * orientation[1] + b.x * orientation[2] + c.x * orientation[0];
  const double bound = in_space * (fabs(a.x) * size[1] + fabs(b.x) * size[2] + fabs(c.x) * size[0]) +
                       4 * least * (1 + fabs(a.x) + fabs(b.x) + fabs(c.x));
  if (!(fabs(volume) > bound)) return {0, 0, false};
  return {turn, turn * sign_of(volume)};
}

}  // namespace hpccd
