// SPDX-License-Identifier: Apache-2.0
// Search for the earliest time at which two features come within a given separation, by inclusion (Snyder 1992; Wang et
// al. 2021): the gap g(t, x, y) = p(t) - x a(t) - y b(t) is linear in each variable, so over a box of (t, x, y) it
// stays within the bounds of its eight corners. A box whose bounds stay outside the separation holds no contact; the
// others are halved, earliest first, until their gap is known to the tolerance.
//
// The guarantee: a pair that comes within `separation` (measured along each axis, hence also in Euclidean distance) is
// reported, at a time no later than this happens. A reported pair comes within separation + tolerance along each axis
// at some time, unless the search was cut off (max_boxes), in which case it is reported as a possible contact.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <queue>
#include <vector>

#include "elementary/motion.h"

namespace hpccd::inclusion {

struct Limits {
  double separation = 0;    // in units of the coordinates
  double tolerance = 1e-6;  // likewise
  int max_boxes = 100000;
};

struct Interval {
  double low, high;
};

// Ranges of the three variables; bisection at dyadic numbers is exact.
struct Domain {
  Interval t, x, y;
};

struct Gap {
  Interval axis[3];
};

inline Interval hull(double a, double b, double c, double d) {
  return {std::min(std::min(a, b), std::min(c, d)), std::max(std::max(a, b), std::max(c, d))};
}

inline Gap gap_over(const Motion<double>& m, const Domain& d) {
  Gap g;
  const double Vec3<double>::* axes[3] = {&Vec3<double>::x, &Vec3<double>::y, &Vec3<double>::z};
  for (int k = 0; k < 3; ++k) {
    const auto axis = axes[k];
    const auto at = [&](double t) {
      const auto mix = [&](const Vec3<double>& v0, const Vec3<double>& v1) {
        return (1 - t) * v0.*axis + t * v1.*axis;
      };
      const double p = mix(m.p0, m.p1), a = mix(m.a0, m.a1), b = mix(m.b0, m.b1);
      return hull(p - d.x.low * a - d.y.low * b, p - d.x.high * a - d.y.low * b, p - d.x.low * a - d.y.high * b,
                  p - d.x.high * a - d.y.high * b);
    };
    const Interval begin = at(d.t.low), end = at(d.t.high);
    g.axis[k] = {std::min(begin.low, end.low), std::max(begin.high, end.high)};
  }
  return g;
}

inline double coordinate(const Vec3<double>& v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

inline Interval Domain::* widest_variable(const Motion<double>& m, const Domain& d, int axis) {
  const auto change = [&](const Vec3<double>& v0, const Vec3<double>& v1) {
    return std::fabs(coordinate(v1, axis) - coordinate(v0, axis));
  };
  const auto size = [&](const Vec3<double>& v0, const Vec3<double>& v1) {
    return std::max(std::fabs(coordinate(v0, axis)), std::fabs(coordinate(v1, axis)));
  };
  const double t = (d.t.high - d.t.low) * (change(m.p0, m.p1) + change(m.a0, m.a1) + change(m.b0, m.b1));
  const double x = (d.x.high - d.x.low) * size(m.a0, m.a1), y = (d.y.high - d.y.low) * size(m.b0, m.b1);
  return t >= x && t >= y ? &Domain::t : x >= y ? &Domain::x : &Domain::y;
}

inline std::optional<double> earliest_within(Kind kind, const Motion<double>& m, const Limits& limits) {
  const Magnitudes<double> size = magnitudes(m);
  // p, x a and y b carry at most 8 roundings each, their sum 2 more.
  const double reach = limits.separation + 12 * 1.2e-16 * (size.p + size.a + size.b);
  struct Later {
    bool operator()(const Domain& l, const Domain& r) const { return l.t.low > r.t.low; }
  };
  std::priority_queue<Domain, std::vector<Domain>, Later> open;
  const auto consider = [&](const Domain& d) {
    if (kind == Kind::vertex_face && d.x.low + d.y.low > 1) return;
    const Gap g = gap_over(m, d);
    for (const Interval& i : g.axis)
      if (i.low > reach || i.high < -reach) return;
    open.push(d);
  };
  consider({{0, 1}, {0, 1}, kind == Kind::vertex_face ? Interval{0, 1} : Interval{-1, 0}});
  for (int boxes = 0; !open.empty(); ++boxes) {
    const Domain d = open.top();
    if (boxes >= limits.max_boxes) return d.t.low;
    open.pop();
    const Gap g = gap_over(m, d);
    // The axis along which the gap reaches out furthest says what to halve: the variable that spreads it most there.
    double furthest = 0;
    int axis = -1;
    for (int k = 0; k < 3; ++k) {
      const double excess = std::max(g.axis[k].high, -g.axis[k].low) - (reach + limits.tolerance);
      if (excess > furthest) furthest = excess, axis = k;
    }
    if (axis < 0) return d.t.low;
    Interval Domain::* const set = widest_variable(m, d, axis);
    const Interval whole = d.*set;
    const double middle = whole.low + 0.5 * (whole.high - whole.low);
    if (!(middle > whole.low && middle < whole.high)) return d.t.low;  // as fine as doubles go
    Domain half = d;
    half.*set = {whole.low, middle};
    consider(half);
    half.*set = {middle, whole.high};
    consider(half);
  }
  return std::nullopt;
}

}  // namespace hpccd::inclusion
