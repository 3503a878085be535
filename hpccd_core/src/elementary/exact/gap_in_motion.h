// SPDX-License-Identifier: Apache-2.0
// The gap between two moving features, computed from the given motion. Positions at one time are rounded, and a short
// gap between rounded positions consists mostly of rounding errors.
#pragma once

#include "elementary/motion.h"

namespace hpccd::exact {

// The unit direction of the gap, from face to vertex or from edge a to edge b, when the features come within d > 0 of
// each other: at `toc`, or later by its rounding. Zero if they touch at toc. q[0..3] as in motion.h, finite.
Vec3<double> direction_of_gap(Kind kind, const Vec3<double> q_t0[4], const Vec3<double> q_t1[4], double toc, double d);

// Whether two edges are parallel at all times.
bool stay_parallel(const Vec3<double> q_t0[4], const Vec3<double> q_t1[4]);

}  // namespace hpccd::exact
