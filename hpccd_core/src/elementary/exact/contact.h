// SPDX-License-Identifier: Apache-2.0
// The exact tier's last resort: the earliest contact of one vertex-face or edge-edge query in integer arithmetic.
#pragma once

#include <optional>

#include "elementary/motion.h"

namespace hpccd::exact {

// q[0..3] as in motion.h, finite. The time is the true one rounded down (error below 2^-60), or nothing.
std::optional<double> earliest_contact(Kind kind, const Vec3<double> q_t0[4], const Vec3<double> q_t1[4]);

}  // namespace hpccd::exact
