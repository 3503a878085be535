// SPDX-License-Identifier: Apache-2.0
// The nearest points of two features at one time: on CPUs and devices.
#pragma once

#include "contacts/arbiters.h"
#include "contacts/meeting_point.h"
#include "elementary/distance/proximity_test.h"
#include "elementary/fallback.h"

namespace hpccd {

struct NearestPoints {
  double distance;
  Vec3<double> on_first, on_second;  // the vertex and the face, or edge a and edge b
  Vec3<double> direction;            // unit length: from face to vertex, or from edge a to edge b; zero at no distance
};

// Of q[0..3] as in motion.h. Where edges are parallel: in the middle of the stretch along which they are nearest.
template <Kind kind, class Arbiter>
HPCCD_HD NearestPoints nearest_points(const Vec3<double> q[4], Arbiter& arbiter) {
  using V = Vec3<double>;
  const Motion<double> m = motion_of<kind>(q, q);
  const Snapshot<double> now{m.p0, m.a0, m.b0};
  const V n = cross(now.a, now.b);
  // Of a small angle between a and b the places lose the square of its sine: below this they would be known to less
  // than 1e-12 of the features' size.
  constexpr double flat = 1e-2;
  const bool place_is_known = dot(n, n) > flat * flat * (dot(now.a, now.a) * dot(now.b, now.b));
  const NearOrFar<double> checked = proximity_test<kind>(now, 0.0);
  if (!place_is_known || !checked.far) {
    const exact::Nearest x = arbiter.nearest(kind, q);
    const V across = kind == Kind::vertex_face ? x.on_first - x.on_second : x.on_second - x.on_first;
    return {x.distance, x.on_first, x.on_second, x.distance > 0 ? unit(across) : V{0, 0, 0}};
  }
  const Nearest<double> found = nearest<kind>(now);
  const V direction = unit(found.straight);
  const double distance = sqrt(found.square);
  if constexpr (kind == Kind::vertex_face) return {distance, q[0], q[1] + found.x * now.a + found.y * now.b, direction};
  return {distance, q[0] + found.x * now.a, q[2] - found.y * now.b, direction};
}

// At a time of the step.
template <Kind kind, class Arbiter>
HPCCD_HD NearestPoints nearest_points(const Vec3<double> t0[4], const Vec3<double> t1[4], double time,
                                      Arbiter& arbiter) {
  Vec3<double> q[4];
  for (int i = 0; i < 4; ++i) q[i] = interpolate(t0[i], t1[i], time);
  return nearest_points<kind>(q, arbiter);
}

NearestPoints nearest_points(const UndecidedPair& pair, double time);

}  // namespace hpccd
