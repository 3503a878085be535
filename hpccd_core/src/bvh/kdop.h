// SPDX-License-Identifier: Apache-2.0
// Bounds of a motion along eight more directions than the axes (k-DOPs, Klosowski et al. 1998), at both of its ends.
// Two features in the same order along one direction at t = 0 and at t = 1 are separated throughout (motion_box.h).
#pragma once

#include "base/vec3.h"
#include "bvh/coordinate_map.h"

namespace hpccd {

inline constexpr int n_kdop_directions = 8;

// Where a vertex is along each direction at the ends of its motion.
struct alignas(64) VertexKdop {
  float t0[n_kdop_directions], t1[n_kdop_directions];
};

// The k-DOP of some vertices, at t = 0 and then at t = 1.
struct alignas(64) Kdop {
  float low[2 * n_kdop_directions], high[2 * n_kdop_directions];
};

// By how much k-DOPs of features may lie apart in each direction that come within a separation of each other.
struct alignas(64) KdopMargin {
  float in[2 * n_kdop_directions] = {};

  KdopMargin() = default;
  // In the map's scale. Rounding: values lie below eight, so two of them and their difference are off by 7.2e-7.
  KdopMargin(double separation, double scale) {
    constexpr double length[n_kdop_directions] = {1.4143, 1.4143, 1.4143, 1.4143, 1.4143, 1.4143, 2.2361, 2.2361};
    for (int k = 0; k < 2 * n_kdop_directions; ++k)
      in[k] = static_cast<float>(separation * length[k % n_kdop_directions] * scale * (1 + 1e-6) + 1e-6);
  }
};

// x along direction k; after those of the k-DOP come the axes. One sum of two terms, one of them perhaps doubled:
// rounded once, which never reverses an order, so no margin is needed. (Sums of three terms would need one. Of all that
// a cache line has room for besides the six diagonals, the last two left the fewest pairs on the published scenes.)
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

// Where a vertex of one snapshot is along the first directions of the k-DOPs that no axis is near to.
struct SlantedCoordinates {
  float along[3];
  HPCCD_HD SlantedCoordinates(const Vec3<double>& x, const CoordinateMap& map) {
    const Vec3<double> center{map.center[0], map.center[1], map.center[2]};
    for (int k = 0; k < 3; ++k)
      along[k] = static_cast<float>((hpccd::along(2 * k, x) - hpccd::along(2 * k, center)) * map.scale);
  }
};

// Neither does the map to float reverse an order (coordinate_map.h).
HPCCD_HD VertexKdop vertex_kdop(const Vec3<double>& t0, const Vec3<double>& t1, const CoordinateMap& map) {
  const Vec3<double> center{map.center[0], map.center[1], map.center[2]};
  VertexKdop kdop;
  for (int k = 0; k < n_kdop_directions; ++k) {
    const double c = along(k, center);
    kdop.t0[k] = static_cast<float>((along(k, t0) - c) * map.scale);
    kdop.t1[k] = static_cast<float>((along(k, t1) - c) * map.scale);
  }
  return kdop;
}

}  // namespace hpccd
