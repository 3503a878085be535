// SPDX-License-Identifier: Apache-2.0
// Point, normal and nearest points of one pair, as far as they are requested. On CPUs and devices.
#pragma once

#include "contacts/contact_point.h"
#include "contacts/nearest_points.h"
#include "contacts/outputs.h"

namespace hpccd {

// Vertices as in motion.h. Outputs that are not requested are zero.
template <Kind kind, class Arbiter>
HPCCD_HD PairPlaces pair_places(const Vec3<double> t0[4], const Vec3<double> t1[4], double toc, double separation,
                                Outputs outputs, Arbiter& arbiter) {
  PairPlaces places{};
  const double time = outputs.at == AtTime::contact ? toc : 0;
  const bool separated = outputs.at == AtTime::contact && separation > 0;
  bool point_open = outputs.points, normal_open = outputs.normals;
  if (outputs.closest || separated) {
    const NearestPoints nearest = nearest_points<kind>(t0, t1, time, arbiter);
    if (outputs.closest) places.closest[0] = nearest.on_first, places.closest[1] = nearest.on_second;
    // At distance 0 as in plain contact: there is no direction between the points.
    if (separated && point_open && nearest.distance > 0) {
      places.point = 0.5 * nearest.on_first + 0.5 * nearest.on_second;
      point_open = false;
    }
    if (separated && normal_open) {
      places.normal = nearest.certain ? nearest.direction : arbiter.direction_of_gap(kind, t0, t1, time, separation);
      normal_open = !(largest(places.normal) > 0);
    }
  }
  if (!point_open && !normal_open) return places;
  const ContactPoint<kind> contact(t0, t1, time);
  if (point_open) places.point = contact.point();
  if (normal_open) places.normal = contact.normal(arbiter);
  return places;
}

}  // namespace hpccd
