// SPDX-License-Identifier: Apache-2.0
// Point, normal, nearest points, weights and approach of one pair, as far as they are requested. On CPUs and devices.
#pragma once

#include "contacts/contact_point.h"
#include "contacts/nearest_points.h"
#include "contacts/outputs.h"

namespace hpccd {

// The derivative of the gap along the normal, at the time of these places. Where the features graze each other it would
// be rounding errors of the motion: these count as 0, because gradients divide by it. So does a positive one of a
// contact within the step: features that touch there for the first time have approached each other.
template <Kind kind>
HPCCD_HD double approach_of(const Vec3<double> t0[4], const Vec3<double> t1[4], double toc, Places at,
                            const Vec3<double>& normal) {
  const Motion<double> m = motion_of<kind>(t0, t1);
  const Vec3<double> dp = m.p1 - m.p0, da = m.a1 - m.a0, db = m.b1 - m.b0;
  const double speed = dot(normal, dp - at.alpha * da - at.beta * db);
  const double rounding = 0x1p-46 * (largest(dp) + largest(da) + largest(db));
  return speed < -rounding || (toc <= 0 && speed > rounding) ? speed : 0;
}

template <Kind kind>
HPCCD_HD void write_weights(Places at, double weights[4]) {
  if (kind == Kind::vertex_face) {
    weights[0] = 1, weights[1] = -greater(0.0, 1 - at.alpha - at.beta), weights[2] = -at.alpha, weights[3] = -at.beta;
  } else {
    weights[0] = -(1 - at.alpha), weights[1] = -at.alpha, weights[2] = 1 + at.beta, weights[3] = -at.beta;
  }
}

// Vertices as in motion.h. Outputs that are not requested are zero, except that the approach brings the normal.
template <Kind kind, class Arbiter>
HPCCD_HD PairPlaces pair_places(const Vec3<double> t0[4], const Vec3<double> t1[4], double toc, double separation,
                                Outputs outputs, Arbiter& arbiter) {
  PairPlaces places{};
  const bool moving = outputs.at == AtTime::contact;
  const double time = moving ? toc : 0;
  const bool separated = moving ? separation > 0 : outputs.normals || outputs.weights;
  const bool approach = outputs.weights && moving;
  bool point_open = outputs.points, normal_open = outputs.normals || approach, places_open = outputs.weights;
  Places at{};
  if (outputs.closest || separated) {
    const NearestPoints nearest = nearest_points<kind>(t0, t1, time, arbiter);
    if (outputs.closest) places.closest[0] = nearest.on_first, places.closest[1] = nearest.on_second;
    // At distance 0 as in plain contact: there is no direction between the points.
    if (separated && nearest.distance > 0) {
      if (point_open) places.point = 0.5 * nearest.on_first + 0.5 * nearest.on_second;
      at = nearest.places;
      point_open = places_open = false;
    }
    if (separated && normal_open) {
      places.normal = nearest.certain ? nearest.direction : arbiter.direction_of_gap(kind, t0, t1, time, separation);
      normal_open = moving && !(largest(places.normal) > 0);
    }
  }
  if (point_open || normal_open || places_open) {
    const ContactPoint<kind> contact(t0, t1, time);
    if (places_open || (point_open && kind == Kind::edge_edge)) at = contact.places();
    if (point_open) places.point = contact.point(at);
    if (normal_open) places.normal = contact.normal(arbiter);
  }
  if (outputs.weights) write_weights<kind>(at, places.weights);
  if (approach) places.approach = approach_of<kind>(t0, t1, toc, at, places.normal);
  return places;
}

}  // namespace hpccd
