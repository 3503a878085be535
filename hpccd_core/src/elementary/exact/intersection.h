// SPDX-License-Identifier: Apache-2.0
// Whether and where an edge intersects or touches a face in one snapshot, in integer arithmetic.
#pragma once

#include <cstdint>

#include "base/vec3.h"

namespace hpccd::exact {

// Whether the edge q[0] q[1] and the face q[2] q[3] q[4], all finite, have a common point, as closed sets. Degenerate
// ones are treated as the segments and points that they are.
bool intersect(const Vec3<double> q[5]);

// Where an edge and a face meet: the position on the edge and the barycentric coordinates on the face, in [0, 1]. If
// they share a segment, its end nearer to the edge's start.
struct IntersectionPlace {
  double edge_parameter;
  double weights[3];
  // What holds exactly, which rounded numbers do not show: bits of `at_start` and so on. without_corner << i: weight i
  // is 0. in_plane: the edge lies in the plane of the face, or the face has no area.
  std::uint8_t incidence;
  static constexpr std::uint8_t at_start = 1, at_end = 2, without_corner = 4, in_plane = 32;
};

// Each number has a relative error of 2^-50. The edge and the face must intersect.
IntersectionPlace place_of_intersection(const Vec3<double> q[5]);

}  // namespace hpccd::exact
