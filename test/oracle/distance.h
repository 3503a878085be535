// SPDX-License-Identifier: Apache-2.0
// Exact distances of closed features at rest: any finite coordinates, degenerate ones included.
#pragma once

#include <array>

#include "integers.h"

namespace oracle {

// Four points: v f0 f1 f2, or a0 a1 b0 b1.
using Points = std::array<std::array<double, 3>, 4>;

// numerator / denominator * 4^exponent
struct SquaredDistance {
  Integer numerator, denominator;
  int exponent;
};

SquaredDistance squared_distance_vertex_face(const Points& points);
SquaredDistance squared_distance_edge_edge(const Points& points);

// Whether the distance is at most d.
bool within_vertex_face(const Points& points, double d);
bool within_edge_edge(const Points& points, double d);

// The distance rounded to the nearest double.
double distance_vertex_face(const Points& points);
double distance_edge_edge(const Points& points);

}  // namespace oracle
