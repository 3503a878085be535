// SPDX-License-Identifier: Apache-2.0
#include "contacts/nearest_points.h"

#include <cmath>

#include "contacts/meeting_point.h"
#include "elementary/distance/proximity_test.h"
#include "elementary/exact/distance.h"

namespace hpccd {
namespace {

using V = Vec3<double>;

template <Kind kind>
NearestPoints nearest_points_of(const V q[4]) {
  const Motion<double> m = motion_of<kind>(q, q);
  const Snapshot<double> now{m.p0, m.a0, m.b0};
  const V n = cross(now.a, now.b);
  // Of a small angle between a and b the places lose the square of its sine: below this they would be known to less
  // than 1e-12 of the features' size.
  constexpr double flat = 1e-2;
  const bool place_is_known = dot(n, n) > flat * flat * (dot(now.a, now.a) * dot(now.b, now.b));
  const NearOrFar<double> checked = proximity_test<kind>(now, 0.0);
  if (!place_is_known || !checked.far) {
    const exact::Nearest x = exact::nearest(kind, q);
    const V across = kind == Kind::vertex_face ? x.on_first - x.on_second : x.on_second - x.on_first;
    return {x.distance, x.on_first, x.on_second, x.distance > 0 ? unit(across) : V{0, 0, 0}};
  }
  const Nearest<double> found = nearest<kind>(now);
  const V direction = unit(found.straight);
  const double distance = std::sqrt(found.square);
  if constexpr (kind == Kind::vertex_face) return {distance, q[0], q[1] + found.x * now.a + found.y * now.b, direction};
  return {distance, q[0] + found.x * now.a, q[2] - found.y * now.b, direction};
}

}  // namespace

NearestPoints nearest_points(const UndecidedPair& pair, double time) {
  V q[4];
  for (int i = 0; i < 4; ++i) q[i] = interpolate(pair.t0[i], pair.t1[i], time);
  return pair.kind == Kind::vertex_face ? nearest_points_of<Kind::vertex_face>(q)
                                        : nearest_points_of<Kind::edge_edge>(q);
}

}  // namespace hpccd
