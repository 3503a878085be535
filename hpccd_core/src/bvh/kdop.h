// SPDX-License-Identifier: Apache-2.0
// Bounds of a motion along eight more directions than the axes (k-DOPs, Klosowski et al. 1998), at both of its ends.
// Two features in the same order along one direction at t = 0 and at t = 1 are separated throughout (motion_box.h).
#pragma once

#include "base/vec3.h"
#include "bvh/coordinate_map.h"

namespace hpccd {

inline constexpr int n_kdop_directions = 8;

// Coordinates of a vertex along each direction at both ends of its motion.
struct alignas(64) VertexKdop {
  float t0[n_kdop_directions], t1[n_kdop_directions];
};

// The k-DOP of several vertices, at t = 0 and then at t = 1.
struct alignas(64) Kdop {
  float low[2 * n_kdop_directions], high[2 * n_kdop_directions];
};

// The largest gap in each direction between k-DOPs of features that come within a separation of each other.
struct alignas(64) KdopMargin {
  float in[2 * n_kdop_directions] = {};

  KdopMargin() = default;
  // In the map's scale. Values are below eight, so two of them and their difference have rounding errors of 7.2e-7.
  KdopMargin(double separation, double scale) {
    constexpr double length[n_kdop_directions] = {1.4143, 1.4143, 1.4143, 1.4143, 1.4143, 1.4143, 2.2361, 2.2361};
    for (int k = 0; k < 2 * n_kdop_directions; ++k)
      in[k] = static_cast<float>(separation * length[k % n_kdop_directions] * scale * (1 + 1e-6) + 1e-6);
  }
};

// The coordinate of x along direction k; the axes follow the directions of the k-DOP. It is one sum of two terms, one
// of them possibly doubled, and is rounded once. This never reverses an order, so no margin is needed. (Sums of three
// terms would need one. Among all directions that fit into a cache line besides the six diagonals, the last two left
// the fewest pairs on the published scenes.)
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

// Coordinates of a vertex of one snapshot along those first directions of the k-DOPs that are far from all axes.
struct SlantedCoordinates {
  float along[3];
  HPCCD_HD SlantedCoordinates(const Vec3<double>& x, const CoordinateMap& map) {
    const Vec3<double> center{map.center[0], map.center[1], map.center[2]};
    for (int k = 0; k < 3; ++k)
      along[k] = static_cast<float>((hpccd::along(2 * k, x) - hpccd::along(2 * k, center)) * map.scale);
  }
};

// The map to float does not reverse an order either (coordinate_map.h).
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
