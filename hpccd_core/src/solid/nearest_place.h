// SPDX-License-Identifier: Apache-2.0
// Where a face is nearest to a point. On CPUs and devices.
#pragma once

#include <math.h>

#include <cstdint>

#include "base/vec3.h"

namespace hpccd {

// A height of a face relative to its longest edge below which its normal is too inaccurate in double precision.
inline constexpr double least_height = 1e-8;

HPCCD_HD double square(const Vec3<double>& x) { return dot(x, x); }

// The corners of a face in ascending order of their numbers: both faces of an edge compute the same distance from it.
struct SortedFace {
  std::uint32_t vertex[3];
  HPCCD_HD SortedFace(std::uint32_t a, std::uint32_t b, std::uint32_t c) : vertex{a, b, c} {
    order(vertex[0], vertex[1]), order(vertex[1], vertex[2]), order(vertex[0], vertex[1]);
  }

 private:
  HPCCD_HD static void order(std::uint32_t& a, std::uint32_t& b) {
    const std::uint32_t least = a < b ? a : b;
    b = a < b ? b : a, a = least;
  }
};

// Where a face is nearest to the origin: corner 0 plus x times its edge to corner 1, plus y times that to corner 2.
struct PlaceOnFace {
  double square;
  double x, y;
  bool certain = true;  // false: a needle, whose inside may be nearer than its border
};

// Rounding: with M the largest coordinate of q, an edge's nearest point has an error of a few 2^-53 M across the gap.
// Inside, the gap from the border is projected on the normal n of direction error delta = 4 2^-53 / least_height at
// most; the projection's error is delta^2 |gap| / 2 < 1e-15 M, and across the plane delta times the face's height,
// which is below 2^-51 M.
HPCCD_HOST_DEVICE inline PlaceOnFace nearest_place(const Vec3<double> q[3],
                                                   const Vec3<double> e[3]) {  // e: 0 to 1, 0 to 2, 1 to 2
  PlaceOnFace best{square(q[0]), 0, 0};
  Vec3<double> gap = q[0];
  const auto keep = [&](const Vec3<double>& g, double x, double y) {
    const double s = square(g);
    if (s < best.square) best.square = s, best.x = x, best.y = y, gap = g;
  };
  keep(q[1], 1, 0);
  keep(q[2], 0, 1);
  double longest = 0;
  for (int i = 0; i < 3; ++i) {
    const Vec3<double>& from = q[i == 2];
    const double along = 0 - dot(from, e[i]), length = square(e[i]);
    longest = greater(longest, length);
    if (!(along > 0 && along < length)) continue;
    const double t = along / length;
    keep(from + t * e[i], i == 0 ? t : i == 1 ? 0 : 1 - t, i == 0 ? 0 : t);
  }
  const Vec3<double> n = cross(e[0], e[1]);
  const double nn = square(n);
  if (!(nn >= least_height * least_height * longest * longest && nn > 1e-280)) {
    best.certain = !(longest > 0);
    return best;
  }
  const double x = 0 - dot(cross(q[0], e[1]), n), y = 0 - dot(cross(e[0], q[0]), n);
  if (!(x >= 0 && y >= 0 && x + y <= nn)) return best;
  const double height = dot(gap, n), s = height * height / nn;
  if (s < best.square) best = {s, x / nn, y / nn};
  return best;
}

// The corners of a face, and its vectors from a point, in units in which the mesh is of the size of one.
struct ScaledFace {
  Vec3<double> at[3], q[3], e[3];

  HPCCD_HD ScaledFace(const Vec3<double>& point, double scale, const Vec3<double> corners[3]) {
    for (int i = 0; i < 3; ++i) at[i] = corners[i], q[i] = scale * (at[i] - point);
    e[0] = scale * (at[1] - at[0]), e[1] = scale * (at[2] - at[0]), e[2] = scale * (at[2] - at[1]);
  }
  HPCCD_HD PlaceOnFace nearest() const { return nearest_place(q, e); }
  // Of a place that is certain.
  HPCCD_HD Vec3<double> point_at(const PlaceOnFace& place) const {
    if (place.x == 1) return at[1];
    if (place.y == 1) return at[2];
    return at[0] + place.x * (at[1] - at[0]) + place.y * (at[2] - at[0]);
  }
  // The inside of a needle is not nearer than its border by more than its height.
  HPCCD_HD double height_of_needle() const {
    return 2 * least_height * sqrt(greater(square(e[0]), greater(square(e[1]), square(e[2]))));
  }
};

// Of a distance, times the scale of scale_for(): distances of the mesh's vertices are below 7 then.
inline constexpr double largest_scaled_error = 1e-13;

// The power of two by which distances of a point are multiplied, so that the largest coordinate of its distance from
// the mesh, `most`, is between 1 and 2.
HPCCD_HD double scale_for(double most) {
  if (!(most > 0)) return 1;
  const int exponent = -ilogb(most);
  return ldexp(1.0, exponent < -1000 ? -1000 : exponent > 1000 ? 1000 : exponent);
}

// Beyond this many times its size, a mesh is searched from a nearer point in the same direction: the distances of its
// faces then differ by less than their rounding errors.
inline constexpr double far_away = 1e9;

}  // namespace hpccd
