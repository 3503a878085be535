// SPDX-License-Identifier: Apache-2.0
// Whether two moving features certainly never come within a separation of each other (along each axis): a cheap answer
// for the many pairs that the search of inclusion.h would take long to exclude.
#pragma once

#include "elementary/coplanarity.h"

namespace hpccd {

// With a gap g = p - x a - y b no larger than s along any axis, p . (a x b) = g . (a x b), of which no part of the sum
// of three exceeds s times 2 |a| |b|. So where the cubic stays beyond 6 s |a| |b|, so do the features.
HPCCD_HD bool planes_stay_separated(const Motion<double>& m, const Magnitudes<double>& size, double separation) {
  if (!in_range(size)) return false;
  const double slack = 6 * (1 + 1e-14) * separation * size.a * size.b;
  return certainly_no_root(coplanarity(m), coplanarity_error(size).coefficient + slack);
}

// The gap along a direction with weights 0, 1 and -1 is linear in time and in the place on each feature, so it stays
// between its values at the corners; within the separation it is at most as many times that as there are weights.
template <Kind kind>
HPCCD_HD bool separated_along(const Motion<double>& m, double sx, double sy, double sz, double reach) {
  double low = INFINITY, high = -INFINITY;
  const auto corner = [&](double gap) { low = lesser(low, gap), high = greater(high, gap); };
  for (int end = 0; end < 2; ++end) {
    const Vec3<double>&p = end ? m.p1 : m.p0, &a = end ? m.a1 : m.a0, &b = end ? m.b1 : m.b0;
    const double gp = sx * p.x + sy * p.y + sz * p.z, ga = sx * a.x + sy * a.y + sz * a.z,
                 gb = sx * b.x + sy * b.y + sz * b.z;
    corner(gp);
    corner(gp - ga);
    if constexpr (kind == Kind::vertex_face) {
      corner(gp - gb);
    } else {
      corner(gp + gb);
      corner(gp - ga + gb);
    }
  }
  const double limit = reach * (magnitude(sx) + magnitude(sy) + magnitude(sz));
  return low > limit || high < -limit;
}

template <Kind kind>
HPCCD_HD bool certainly_separated(const Motion<double>& m, double separation) {
  const Magnitudes<double> size = magnitudes(m);
  if (planes_stay_separated(m, size, separation)) return true;
  // Each gap adds up at most nine coordinates of these sizes, each with at most five roundings.
  const double reach = separation + 20 * 1.2e-16 * (size.p + size.a + size.b);
  return separated_along<kind>(m, 1, 1, 0, reach) || separated_along<kind>(m, 1, -1, 0, reach) ||
         separated_along<kind>(m, 0, 1, 1, reach) || separated_along<kind>(m, 0, 1, -1, reach) ||
         separated_along<kind>(m, 1, 0, 1, reach) || separated_along<kind>(m, -1, 0, 1, reach) ||
         separated_along<kind>(m, 1, 1, 1, reach) || separated_along<kind>(m, 1, -1, -1, reach);
}

}  // namespace hpccd
