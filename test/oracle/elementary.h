// SPDX-License-Identifier: Apache-2.0
// Exact elementary tests: linear motion, closed features, any finite coordinates, degenerate ones included.
#pragma once

#include <array>
#include <optional>

namespace oracle {

// Four points at t=0, then the same four at t=1.
using Query = std::array<std::array<double, 3>, 8>;

// Points: vertex, then the face's three corners. The earliest time of contact, rounded down to a double, if
// any.
std::optional<double> vertex_face(const Query& query);

// Points: the first edge's two ends, then the second's.
std::optional<double> edge_edge(const Query& query);

}  // namespace oracle
