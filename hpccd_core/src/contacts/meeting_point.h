// SPDX-License-Identifier: Apache-2.0
// The point where two touching segments meet. The segments may be parallel, points, and of any two lengths. On CPUs
// and devices.
#pragma once

#include <math.h>

#include "base/vec3.h"

namespace hpccd {

// max_norm without comparisons, whose outcomes are unpredictable branches.
HPCCD_HD double largest(Vec3<double> v) { return greater(fabs(v.z), greater(fabs(v.y), fabs(v.x))); }

HPCCD_HD double clamped(double place) { return lesser(1.0, greater(0.0, place)); }

// Scaled first, so that lengths near the ends of the number range do not overflow or underflow when squared. Zero stays
// zero.
HPCCD_HD Vec3<double> unit(Vec3<double> v) {
  const double most = largest(v);
  if (!(most > 0)) return {0, 0, 0};
  v = {v.x / most, v.y / most, v.z / most};
  return (1 / sqrt(dot(v, v))) * v;
}

struct Segment {
  Vec3<double> start, along;
  HPCCD_HD Vec3<double> at(double place) const { return start + place * along; }
};

// The position on the segment nearest to x. Divides by the length twice: its square may underflow.
HPCCD_HOST_DEVICE inline double nearest_place(const Segment& s, Vec3<double> x) {
  const double size = largest(s.along);
  if (!(size > 0)) return 0;
  const Vec3<double> u{s.along.x / size, s.along.y / size, s.along.z / size};
  return clamped(dot(x - s.start, u) / dot(u, u) / size);
}

// The position on `longer`, which is not a point, where the lines cross; for parallel segments the middle of the part
// that `shorter` overlaps.
HPCCD_HOST_DEVICE inline double crossing_place(const Segment& longer, const Segment& shorter) {
  // Below this sine the whole overlap is within 1e-10 of both segments. Above it the crossing has an error of 1e-6 of
  // the length along them, and so of 1e-16 across.
  constexpr double parallel = 1e-10;
  const Vec3<double> u = unit(longer.along), v = unit(shorter.along), n = cross(u, v);
  const double nn = dot(n, n);
  if (nn > parallel * parallel) {
    const double distance = dot(cross(shorter.start - longer.start, v), n) / nn;
    return nearest_place(longer, longer.start + distance * u);
  }
  return 0.5 * (nearest_place(longer, shorter.at(0)) + nearest_place(longer, shorter.at(1)));
}

// The position on `shorter` nearest to `longer`.
HPCCD_HOST_DEVICE inline double meeting_place(const Segment& longer, const Segment& shorter) {
  const double size = largest(longer.along);
  if (!(size > 0)) return 0;
  const auto gap = [&](double place) {
    const Vec3<double> x = shorter.at(place);
    return largest(x - longer.at(nearest_place(longer, x)));
  };
  double best = nearest_place(shorter, longer.at(crossing_place(longer, shorter))), least = gap(best);
  if (least <= 1e-10 * size) return best;
  // Two segments that do not cross are nearest at an end of one of them.
  const double ends[4] = {0, 1, nearest_place(shorter, longer.at(0)), nearest_place(shorter, longer.at(1))};
  for (const double place : ends)
    if (const double g = gap(place); g < least) least = g, best = place;
  return best;
}

}  // namespace hpccd
