// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <math.h>

#include "bvh/kdop.h"
#include "elementary/motion.h"

namespace hpccd {

// Whether two features are in the same order along a direction at both ends of the motion. place(end, i): coordinate of
// vertex i along the direction at that end.
template <Kind kind, class Place>
HPCCD_HD bool in_order(Place&& place) {
  using R = decltype(place(0, 0));
  constexpr int n_first = kind == Kind::vertex_face ? 1 : 2;
  bool below = true, above = true;  // the first feature at both ends
  for (int end = 0; end < 2; ++end) {
    R low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    for (int i = 0; i < 4; ++i) {
      const R x = place(end, i);
      const int feature = i >= n_first;
      low[feature] = lesser(low[feature], x);
      high[feature] = greater(high[feature], x);
    }
    below = below && high[0] < low[1];
    above = above && high[1] < low[0];
  }
  return below || above;
}

// Whether two features are separated along a direction of their k-DOPs or along an axis, in double precision. This
// includes all pairs that boxes and k-DOPs in single precision separate: a tier whose fallback has a tolerance asks it
// first, so that its result does not depend on previous filters.
template <Kind kind>
HPCCD_HD bool apart(const Vec3<double> t0[4], const Vec3<double> t1[4]) {
  for (int k = 0; k < n_kdop_directions + 3; ++k)
    if (in_order<kind>([&](int end, int i) { return along(k, (end == 0 ? t0 : t1)[i]); })) return true;
  return false;
}

}  // namespace hpccd
