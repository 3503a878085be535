// SPDX-License-Identifier: Apache-2.0
// Bounds of a motion along eight more directions than the axes (k-DOPs, Klosowski et al. 1998), at both of its ends:
// features in the same order along one of them at t = 0 and at t = 1 are apart throughout (bvh/motion_box.h). A pair
// costs four loads, four minima and maxima and two comparisons, and on the published scenes 60 to 85 % of the pairs
// whose boxes overlap end here.
#pragma once

#include <math.h>

#include "base/vec3.h"
#include "bvh/coordinate_map.h"
#include "elementary/motion.h"

namespace hpccd {

inline constexpr int n_slabs = 8, n_axes = 3;

// Where a vertex is along each direction at the ends of its motion.
struct alignas(64) SlabRow {
  float t0[n_slabs], t1[n_slabs];
};

// x along direction k; after the slabs come the axes. One sum of two terms, one of them perhaps doubled: rounded once,
// which never reverses an order, so no margin is needed. (Sums of three terms would need one. Of all that a cache line
// has room for besides the six diagonals, the last two left the fewest pairs on the published scenes.)
HPCCD_HD double along(int k, const Vec3<double>& x) {
  switch (k) {
    case 0:
      return x.x + x.y;
    case 1:
      return x.x - x.y;
    case 2:
      return x.y + x.z;
    case 3:
      return x.y - x.z;
    case 4:
      return x.z + x.x;
    case 5:
      return x.z - x.x;
    case 6:
      return x.x + 2 * x.y;
    case 7:
      return x.x + 2 * x.z;
    case 8:
      return x.x;
    case 9:
      return x.y;
    default:
      return x.z;
  }
}

// Neither does the map to float reverse an order (bvh/coordinate_map.h).
HPCCD_HD SlabRow slab_row(const Vec3<double>& t0, const Vec3<double>& t1, const CoordinateMap& map) {
  const Vec3<double> center{map.center[0], map.center[1], map.center[2]};
  SlabRow row;
  for (int k = 0; k < n_slabs; ++k) {
    const double c = along(k, center);
    row.t0[k] = static_cast<float>((along(k, t0) - c) * map.scale);
    row.t1[k] = static_cast<float>((along(k, t1) - c) * map.scale);
  }
  return row;
}

// The same question for one pair in double precision, along the axes too. Whatever boxes and rows of floats say is
// apart, this does: a tier whose last resort has a tolerance asks it first, so that its answer does not depend on who
// filtered before.
template <Kind kind>
HPCCD_HD bool apart(const Vec3<double> t0[4], const Vec3<double> t1[4]) {
  constexpr int n_first = kind == Kind::vertex_face ? 1 : 2;
  for (int k = 0; k < n_slabs + n_axes; ++k) {
    bool below = true, above = true;  // the first feature at both ends
    for (int end = 0; end < 2; ++end) {
      double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
      for (int i = 0; i < 4; ++i) {
        const double x = along(k, (end == 0 ? t0 : t1)[i]);
        const int feature = i >= n_first;
        low[feature] = lesser(low[feature], x);
        high[feature] = greater(high[feature], x);
      }
      below = below && high[0] < low[1];
      above = above && high[1] < low[0];
    }
    if (below || above) return true;
  }
  return false;
}

}  // namespace hpccd
