// SPDX-License-Identifier: Apache-2.0
// Euclidean distances between the closed features of one vertex-face or edge-edge query at rest, in integers.
// Degenerate features are treated as the segments or points that they are.
#pragma once

#include "elementary/motion.h"

namespace hpccd::exact {

// Whether the distance is at most d >= 0, for finite q[0..3] (v f0 f1 f2 or a0 a1 b0 b1) and d.
bool within(Kind kind, const Vec3<double> q[4], double d);

// The exact distance with an error of at most one unit in the last place; 0 only if the features touch.
double distance(Kind kind, const Vec3<double> q[4]);

struct Nearest {
  double distance;
  Vec3<double> on_first, on_second;
};

// For parallel edges side by side: the middle of the common stretch. Coordinates of the points have errors of a few
// roundings of the vertices' coordinates. parallel: the edges are known to be parallel, whatever the rounding of q.
Nearest nearest(Kind kind, const Vec3<double> q[4], bool parallel = false);

}  // namespace hpccd::exact
