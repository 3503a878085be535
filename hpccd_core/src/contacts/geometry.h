// SPDX-License-Identifier: Apache-2.0
// Where two features touch and along which direction, at their time of contact.
#pragma once

#include "elementary/batch.h"

namespace hpccd {

struct ContactPoint {
  double point[3], normal[3];
};

// point: the vertex; or on the shorter edge where the other crosses it, in the middle of what they share where they are
// parallel. normal: unit length, at toc, of the face towards the side on which the vertex is just before toc, or a x b
// from a towards the side on which b is then. With contact at t = 0 just before it is where the straight-line motion
// would have come from. Zero where there is no such side, because the motion is coplanar throughout, or no direction,
// because features are degenerate or parallel at toc. Neither names nor their order matter to any of this.
ContactPoint contact_point(const Geometry& geometry, Kind kind, std::uint32_t first, std::uint32_t second, double toc);

}  // namespace hpccd
