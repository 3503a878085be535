// SPDX-License-Identifier: Apache-2.0
// Decides whether an edge intersects or touches a face in one snapshot, in integer arithmetic.
#pragma once

#include "base/vec3.h"

namespace hpccd::exact {

// Whether the edge q[0] q[1] and the face q[2] q[3] q[4], all finite, have a common point, as closed sets. Degenerate
// ones are treated as the segments and points that they are.
bool intersect(const Vec3<double> q[5]);

}  // namespace hpccd::exact
