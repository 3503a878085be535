// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>

namespace oracle {

// Where the closed edge q[0] q[1] enters the closed face q[2] q[3] q[4]: the least parameter along the edge, the
// barycentric coordinates and the point, each rounded to the nearest double; none where they share no point. An edge
// of length zero has parameter 0. Barycentric coordinates of a face without area are NaN.
std::optional<std::array<double, 7>> edge_face_point(const std::array<std::array<double, 3>, 5>& q);

}  // namespace oracle
