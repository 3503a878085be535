// SPDX-License-Identifier: Apache-2.0
// Decides cheaply whether the features of one pair certainly stay apart up to a given time. Used where only the
// earliest contact matters: much cheaper than deciding whether they touch at all.
#pragma once

#include "base/hd.h"
#include "base/vec3.h"
#include "elementary/pair.h"

namespace hpccd {

// Positions in the order of pair_vertices. True if along some axis the features are farther apart than the separation,
// in the same order at the start and at the given time, and so in between (bvh/motion_box.h).
template <Kind kind>
HPCCD_HD bool apart_until(const Vec3<double> (&t0)[4], const Vec3<double> (&t1)[4], double time, double separation) {
  constexpr int of_first = kind == Kind::edge_edge ? 2 : 1;
  const auto along = [](const Vec3<double>& x, int axis) { return axis == 0 ? x.x : axis == 1 ? x.y : x.z; };
  for (int axis = 0; axis < 3; ++axis) {
    bool first_below = true, second_below = true;
    for (int end = 0; end < 2; ++end) {
      double low[2], high[2], largest = 0;
      for (int i = 0; i < 4; ++i) {
        const double x0 = along(t0[i], axis), x1 = along(t1[i], axis), x = end ? x0 + time * (x1 - x0) : x0;
        const int feature = i >= of_first;
        const bool begins = i == 0 || i == of_first;
        low[feature] = begins ? x : lesser(low[feature], x), high[feature] = begins ? x : greater(high[feature], x);
        largest = greater(largest, greater(magnitude(x0), magnitude(x1)));
      }
      // Four rounding errors of at most half a unit in the last place of twice the largest value, on either side.
      const double slack = separation + 4e-15 * largest;
      first_below = first_below && high[0] + slack < low[1];
      second_below = second_below && high[1] + slack < low[0];
    }
    if (first_below || second_below) return true;
  }
  return false;
}

}  // namespace hpccd
