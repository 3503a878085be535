// SPDX-License-Identifier: Apache-2.0
// Where two features touch and along which direction, at their time of contact.
#pragma once

#include "elementary/batch.h"

namespace hpccd {

struct ContactPoint {
  double point[3], normal[3];
};

// point: the vertex; or on the shorter edge where the other crosses it, in the middle of what they share where they are
// parallel. normal: unit length, of the face
// (oriented towards the side from which the vertex comes) or a x b (oriented from a towards the side from which b
// comes); zero where degenerate features define none.
ContactPoint contact_point(const Geometry& geometry, Kind kind, std::uint32_t first, std::uint32_t second, double toc);

}  // namespace hpccd
