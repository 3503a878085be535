// SPDX-License-Identifier: Apache-2.0
// Where an edge and a face that intersect meet.
#pragma once

#include "elementary/exact/intersection.h"
#include "elementary/inside.h"

namespace hpccd {

using IntersectionPlace = exact::IntersectionPlace;

// Of the positions in the order of exact/intersection.h. Each number is within 1e-12 of the exact one.
IntersectionPlace intersection_place(const Vec3<double> q[5]);

inline Vec3<double> point_on_edge(const Vec3<double> q[5], const IntersectionPlace& place) {
  return interpolate(q[0], q[1], place.edge_parameter);
}

}  // namespace hpccd
