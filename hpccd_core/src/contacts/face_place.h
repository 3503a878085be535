// SPDX-License-Identifier: Apache-2.0
// Barycentric coordinates of a point of a triangle of any shape. On CPUs and devices.
#pragma once

#include "contacts/meeting_point.h"

namespace hpccd {

// Places on two features: alpha on span a, beta on span b, as in p = alpha a + beta b (motion.h). On edge b the place
// is -beta.
struct Places {
  double alpha, beta;
};

// Of a point p on the triangle with the corners 0, a and b: the point alpha a + beta b is p to a few roundings of the
// triangle's size, also where that is a sliver, an edge or a point. Found along the longest edge and perpendicular to
// it, so that errors relative to the height of a sliver move the point by no more than that height.
HPCCD_HOST_DEVICE inline Places face_place(Vec3<double> p, Vec3<double> a, Vec3<double> b) {
  using V = Vec3<double>;
  const double size = greater(largest(a), largest(b));
  if (!(size > 0)) return {0, 0};
  const auto scaled = [size](const V& v) { return V{v.x / size, v.y / size, v.z / size}; };
  p = scaled(p), a = scaled(a), b = scaled(b);
  const V c = b - a;
  const double aa = dot(a, a), bb = dot(b, b), cc = dot(c, c);
  const int base = aa >= bb && aa >= cc ? 0 : bb >= cc ? 1 : 2;  // 0 to a, 0 to b, a to b
  const V e = base == 0 ? a : base == 1 ? b : c, x = base == 2 ? p - a : p;
  const V apex = base == 0 ? b : base == 1 ? a : V{-a.x, -a.y, -a.z};
  const double per_ee = 1 / (base == 0 ? aa : base == 1 ? bb : cc);
  const double foot = clamped(per_ee * dot(apex, e)), place = clamped(per_ee * dot(x, e));
  const V height = apex - foot * e;
  const double high = largest(height);
  double up = 0;
  if (high > 0) {
    const V h{height.x / high, height.y / high, height.z / high};
    up = clamped(dot(x - place * e, h) / dot(h, h) / high);
  }
  // Where rounding takes the point across a side at the apex, it stays where it is along the edge.
  double end = place - up * foot, start = 1 - up - end;
  if (end < 0) {
    end = 0, up = place / foot, start = 1 - up;
  } else if (start < 0) {
    up = foot < 1 ? lesser(1.0, (1 - place) / (1 - foot)) : 0, start = 0, end = 1 - up;
  }
  return base == 0 ? Places{end, up} : base == 1 ? Places{up, end} : Places{start, end};
}

}  // namespace hpccd
