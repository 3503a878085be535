// SPDX-License-Identifier: Apache-2.0
// Bounds of rounding: those of hpccd_ros/rigid/rounding.py, which derives them, to the last bit.
#pragma once

#include "rigid/pose.h"

namespace hpccd::rigid {

inline constexpr double unit = 0x1p-53;
inline constexpr double tiny = 1e-150;  // lengths below it come from squares that underflow

// Not below the number that a few operations on floats meant; 0 stays 0.
inline double up(double bound) { return bound * (1.0 + 0x1p-48); }

// Not below the length; 0 of zeros.
inline double length(const Vector& v) { return any(v) ? up(std::sqrt(dot(v, v))) + tiny : 0.0; }

// values: sum over all joints of |q_0| + |q_1 - q_0|; reach: from the world's origin, base included.
inline double rounding_at_chain(double joints, double reach, double values) {
  return up(unit * reach * (128.0 * joints + 256.0 + 4.0 * values) + tiny);
}

}  // namespace hpccd::rigid
