// SPDX-License-Identifier: Apache-2.0
// The nearest points of two features at one time. On CPUs and devices.
#pragma once

#include "contacts/arbiters.h"
#include "contacts/face_place.h"
#include "elementary/distance/proximity_test.h"
#include "elementary/fallback.h"

namespace hpccd {

struct NearestPoints {
  double distance;
  Vec3<double> on_first, on_second;  // on the vertex and the face, or on edge a and edge b
  Vec3<double> direction;            // unit length: from face to vertex, or from edge a to edge b; zero at distance 0
  Places places;
  bool certain;  // the direction is reliable: not dominated by rounding errors of positions
};

// At a time of the step. For parallel edges: in the middle of the stretch along which they are nearest.
template <Kind kind, class Arbiter>
HPCCD_HD NearestPoints nearest_points(const Vec3<double> t0[4], const Vec3<double> t1[4], double time,
                                      Arbiter& arbiter) {
  using V = Vec3<double>;
  V q[4];
  for (int i = 0; i < 4; ++i) q[i] = interpolate(t0[i], t1[i], time);
  const Motion<double> m = motion_of<kind>(q, q);
  const Snapshot<double> now{m.p0, m.a0, m.b0};
  const V n = cross(now.a, now.b);
  // For a small angle between a and b, positions lose the square of its sine in accuracy: below this value they would
  // be known to less than 1e-12 of the features' size.
  constexpr double flat = 1e-2;
  const bool place_is_known = dot(n, n) > flat * flat * (dot(now.a, now.a) * dot(now.b, now.b));
  const NearOrFar<double> checked = proximity_test<kind>(now, 0.0);
  // Positions are rounded by a few 2^-53 of their coordinates, or by 2^-1074 if that is more: directions of vectors
  // longer than this are accurate to 1e-6 or better.
  const double size = greater(greater(largest(q[0]), largest(q[1])), greater(largest(q[2]), largest(q[3])));
  const double long_enough = greater(0x1p-30 * size, 0x1p-1044);
  if (!place_is_known || !checked.far) {
    const exact::Nearest x = arbiter.nearest(kind, t0, t1, q);
    const V across = kind == Kind::vertex_face ? x.on_first - x.on_second : x.on_second - x.on_first;
    const Places places = kind == Kind::vertex_face ? face_place(x.on_second - q[1], now.a, now.b)
                                                    : Places{nearest_place({q[0], now.a}, x.on_first),
                                                             -nearest_place({q[2], now.b}, x.on_second)};
    const V direction = x.distance > 0 ? unit(across) : V{0, 0, 0};
    return {x.distance, x.on_first, x.on_second, direction, places, x.distance > long_enough};
  }
  const detail::Place<double> place = detail::best_place<kind>(now);
  const Nearest<double> found = detail::straightened(place, now);
  const V direction = unit(found.straight);
  const double distance = sqrt(found.square);
  // A gap in the interior of both features has the direction of n: its length only has to determine the side.
  const bool certain = distance > long_enough || (place.inside && distance > 0x1p-45 * size &&
                                                  largest(n) > long_enough * (largest(now.a) + largest(now.b)));
  if constexpr (kind == Kind::vertex_face)
    return {distance, q[0], q[1] + found.x * now.a + found.y * now.b, direction, {found.x, found.y}, certain};
  return {distance, q[0] + found.x * now.a, q[2] - found.y * now.b, direction, {found.x, found.y}, certain};
}

}  // namespace hpccd
