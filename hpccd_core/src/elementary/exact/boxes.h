// SPDX-License-Identifier: Apache-2.0
// The boxes of two features over a step.
#pragma once

#include <algorithm>
#include <cmath>

#include "elementary/motion.h"

namespace hpccd::exact {

HPCCD_HOST_DEVICE inline double coordinate(const Vec3<double>& v, int k) { return k == 0 ? v.x : k == 1 ? v.y : v.z; }

// Whether they are farther apart than d along some axis. A rounded difference of doubles exceeds d only if the exact
// one does.
HPCCD_HOST_DEVICE inline bool boxes_apart(Kind kind, const Vec3<double> q_t0[4], const Vec3<double> q_t1[4], double d) {
  const int split = kind == Kind::vertex_face ? 1 : 2;
  for (int k = 0; k < 3; ++k) {
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    for (int i = 0; i < 4; ++i)
      for (const auto* q : {q_t0, q_t1}) {
        const double x = coordinate(q[i], k);
        low[i >= split] = std::min(low[i >= split], x);
        high[i >= split] = std::max(high[i >= split], x);
      }
    if (low[1] - high[0] > d || low[0] - high[1] > d) return true;
  }
  return false;
}

}  // namespace hpccd::exact
