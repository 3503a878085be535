// SPDX-License-Identifier: Apache-2.0
// The earliest time at which the features of one vertex-face or edge-edge query come within a distance, in integers.
#pragma once

#include <optional>

#include "elementary/motion.h"

namespace hpccd::exact {

// The earliest t in [0, 1] at which the Euclidean distance between the closed features is at most d > 0, rounded down
// (error below 2^-60), or nothing. q[0..3] as in motion.h; they and d finite.
std::optional<double> earliest_within(Kind kind, const Vec3<double> q_t0[4], const Vec3<double> q_t1[4], double d);

}  // namespace hpccd::exact
