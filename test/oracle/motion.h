// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "elementary.h"
#include "polynomial.h"

namespace oracle {

// The four points' motion as polynomials of degree one. All coordinates are multiplied by one power of two
// that makes them integers, which changes neither contacts nor times.
std::array<Vector, 4> motion(const Query& query);

// The same with a distance, multiplied by the same power.
struct MotionAndDistance {
  std::array<Vector, 4> points;
  Integer distance;
};
MotionAndDistance motion_and_distance(const Query& query, double distance);

}  // namespace oracle
