// SPDX-License-Identifier: Apache-2.0
// The gap g(t, x, y) = p(t) - x a(t) - y b(t) of two features along some directions, and what its bounds on a box say:
// where it certainly stays outside the separation.
#pragma once

#include <algorithm>
#include <cmath>

#include "elementary/motion.h"

namespace hpccd::inclusion {

struct Interval {
  double low, high;
  double width() const { return high - low; }
};

// Ranges of the three variables.
struct Domain {
  Interval t, x, y;
};

// p, a and b along one direction at both ends; within the separation the gap is at most `reach` there.
struct Projection {
  double p[2], a[2], b[2], reach;
};

inline Interval hull(Interval a, Interval b) { return {std::min(a.low, b.low), std::max(a.high, b.high)}; }

// The gap on a box's six sides.
struct Sides {
  Interval t[2], x[2], y[2];

  Sides(const Projection& r, const Domain& d) {
    Interval edge[2][2];  // by t and x, over y
    for (int i = 0; i < 2; ++i) {
      const double time = i ? d.t.high : d.t.low;
      const auto at = [&](const double v[2]) { return (1 - time) * v[0] + time * v[1]; };
      const double p = at(r.p), a = at(r.a), b = at(r.b), y0 = d.y.low * b, y1 = d.y.high * b;
      for (int j = 0; j < 2; ++j) {
        const double g = p - (j ? d.x.high : d.x.low) * a, g0 = g - y0, g1 = g - y1;
        edge[i][j] = {std::min(g0, g1), std::max(g0, g1)};
        y[0] = i + j ? hull(y[0], {g0, g0}) : Interval{g0, g0};
        y[1] = i + j ? hull(y[1], {g1, g1}) : Interval{g1, g1};
      }
    }
    for (int i = 0; i < 2; ++i) t[i] = hull(edge[i][0], edge[i][1]), x[i] = hull(edge[0][i], edge[1][i]);
  }
};

// Narrows one variable: between two opposite sides the least gap lies above the chord of its values on them, the
// largest below, since the gap is linear in the variable. False where nothing is left.
inline bool clip(Interval& v, const Interval side[2], double reach) {
  const double width = v.width();
  double from = 0, to = 1;                            // places between the sides
  const auto cut = [&](double over0, double over1) {  // how far beyond the reach on each side
    if (over0 > 0 && over1 > 0) return false;
    // Three roundings of a quotient, and one of the sums below.
    constexpr double down = 1 - 1e-15;
    if (over0 > 0) from = std::max(from, down * (over0 / (over0 - over1)));
    if (over1 > 0) to = std::min(to, 1 - down * (over1 / (over1 - over0)));
    return true;
  };
  if (!cut(side[0].low - reach, side[1].low - reach) || !cut(-reach - side[0].high, -reach - side[1].high))
    return false;
  constexpr double rounding = 4e-16;  // of places and variables up to one
  if (from > to + rounding) return false;
  const double low = v.low + from * width - rounding, high = v.low + to * width + rounding;
  v = {std::max(v.low, low), std::min(v.high, high)};
  return true;
}

// The three axes, and three directions along each of which mostly one variable counts at the middle of the step.
class GapBounds {
 public:
  GapBounds(const Motion<double>& m, double separation) {
    const Magnitudes<double> size = magnitudes(m);
    // Along an axis p, x a and y b carry at most 8 roundings each, their sum 2 more; along other directions 5 more.
    const double reach = separation + 24 * 1.2e-16 * (size.p + size.a + size.b);
    add(m, {1, 0, 0}, reach), add(m, {0, 1, 0}, reach), add(m, {0, 0, 1}, reach);
    const Vec3<double> a = m.a0 + m.a1, b = m.b0 + m.b1, p = m.p1 - m.p0;
    for (const Vec3<double>& d : {cross(a, b), cross(b, p), cross(p, a)}) {
      const double norm = std::fabs(d.x) + std::fabs(d.y) + std::fabs(d.z);
      if (norm > 1e-300 && norm < 1e300) add(m, (1 / norm) * d, reach);
    }
  }

  const Projection& axis(int k) const { return along_[k]; }
  double reach(int k) const { return along_[k].reach; }
  Interval gap(int k, const Domain& d) const {
    const Sides s(along_[k], d);
    return hull(s.t[0], s.t[1]);
  }

  // Narrows the box to where the features can be within the separation. False where they cannot.
  bool clip(Kind kind, Domain& d) const {
    for (;;) {
      const Domain before = d;
      for (int k = 0; k < n_; ++k) {
        const Sides s(along_[k], d);
        if (!inclusion::clip(d.t, s.t, along_[k].reach) || !inclusion::clip(d.x, s.x, along_[k].reach) ||
            !inclusion::clip(d.y, s.y, along_[k].reach))
          return false;
      }
      if (kind == Kind::vertex_face) {
        if (d.x.low + d.y.low > 1) return false;
        constexpr double rounding = 1e-15;
        d.x.high = std::min(d.x.high, 1 - d.y.low + rounding);
        d.y.high = std::min(d.y.high, 1 - d.x.low + rounding);
      }
      // Another round where this one took away a good part.
      constexpr double good = 0.7;
      if (d.t.width() >= good * before.t.width() && d.x.width() >= good * before.x.width() &&
          d.y.width() >= good * before.y.width())
        return true;
    }
  }

 private:
  void add(const Motion<double>& m, const Vec3<double>& d, double reach) {
    const double one_norm = std::fabs(d.x) + std::fabs(d.y) + std::fabs(d.z);
    along_[n_++] = {{dot(d, m.p0), dot(d, m.p1)},
                    {dot(d, m.a0), dot(d, m.a1)},
                    {dot(d, m.b0), dot(d, m.b1)},
                    one_norm * (1 + 1e-15) * reach};
  }

  Projection along_[6];
  int n_ = 0;
};

}  // namespace hpccd::inclusion
