// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

namespace oracle {

// Whether the closed edge q[0] q[1] and the closed face q[2] q[3] q[4] share a point; exact for any finite
// coordinates. Degenerate ones are the segments and points that they are.
bool edge_face_intersect(const std::array<std::array<double, 3>, 5>& q);

}  // namespace oracle
