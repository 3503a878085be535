// SPDX-License-Identifier: Apache-2.0
// The nearest points of two features at one time.
#pragma once

#include "elementary/undecided.h"

namespace hpccd {

struct NearestPoints {
  double distance;
  Vec3<double> on_first, on_second;  // the vertex and the face, or edge a and edge b
  Vec3<double> direction;            // unit length: from face to vertex, or from edge a to edge b; zero at no distance
};

// Where edges are parallel: in the middle of the stretch along which they are nearest.
NearestPoints nearest_points(const UndecidedPair& pair, double time);

}  // namespace hpccd
