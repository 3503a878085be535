// SPDX-License-Identifier: Apache-2.0
// Exact elementary tests with a margin: when moving closed features first come within a distance of each other.
#pragma once

#include <optional>

#include "elementary.h"

namespace oracle {

// The earliest t in [0,1] at which the Euclidean distance is at most d (>= 0), rounded down to a double; none where it
// never is.
std::optional<double> separation_vertex_face(const Query& query, double d);
std::optional<double> separation_edge_edge(const Query& query, double d);

}  // namespace oracle
