// SPDX-License-Identifier: Apache-2.0
// Search for the earliest time at which two features come within a given separation, by inclusion (Snyder 1992; Wang et
// al. 2021): the gap g(t, x, y) = p(t) - x a(t) - y b(t) is linear in each variable, so over a box of (t, x, y) it
// stays within the bounds of its eight corners. A box whose bounds stay outside the separation holds no contact; the
// others are clipped where the bounds say so (gap_bounds.h) and halved, earliest first, until their gap is known to
// the tolerance.
//
// The guarantee: a pair that comes within `separation` (measured along each axis, hence also in Euclidean distance) is
// reported, at a time no later than this happens. A reported pair comes within separation + tolerance along each axis
// at some time, unless the search was cut off (max_boxes), in which case it is reported as a possible contact.
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "base/cancellation.h"
#include "elementary/gap_bounds.h"

namespace hpccd::inclusion {

struct Limits {
  double separation = 0;    // in units of the coordinates
  double tolerance = 1e-6;  // likewise
  int max_boxes = 100000;
  const Cancellation* cancellation = &never_cancelled;  // so many boxes take 0.1 s and more
};

inline Interval Domain::* widest_variable(const Projection& axis, const Domain& d) {
  const auto change = [](const double v[2]) { return std::fabs(v[1] - v[0]); };
  const auto size = [](const double v[2]) { return std::max(std::fabs(v[0]), std::fabs(v[1])); };
  const double t = d.t.width() * (change(axis.p) + change(axis.a) + change(axis.b));
  const double x = d.x.width() * size(axis.a), y = d.y.width() * size(axis.b);
  return t >= x && t >= y ? &Domain::t : x >= y ? &Domain::x : &Domain::y;
}

inline std::optional<double> earliest_within(Kind kind, const Motion<double>& m, const Limits& limits) {
  const GapBounds bounds(m, limits.separation);
  const auto later = [](const Domain& l, const Domain& r) { return l.t.low > r.t.low; };
  std::vector<Domain> open;  // a heap
  open.reserve(64);
  const auto consider = [&](Domain d) {
    if (!bounds.clip(kind, d)) return;
    open.push_back(d);
    std::push_heap(open.begin(), open.end(), later);
  };
  consider({{0, 1}, {0, 1}, kind == Kind::vertex_face ? Interval{0, 1} : Interval{-1, 0}});
  for (int boxes = 0; !open.empty(); ++boxes) {
    limits.cancellation->heed();
    std::pop_heap(open.begin(), open.end(), later);
    const Domain d = open.back();
    if (boxes >= limits.max_boxes) return d.t.low;
    open.pop_back();
    // The axis along which the gap reaches out furthest says what to halve: the variable that spreads it most there.
    double furthest = 0;
    int axis = -1;
    for (int k = 0; k < 3; ++k) {
      const Interval g = bounds.gap(k, d);
      const double excess = std::max(g.high, -g.low) - (bounds.reach(k) + limits.tolerance);
      if (excess > furthest) furthest = excess, axis = k;
    }
    if (axis < 0) return d.t.low;
    Interval Domain::* const set = widest_variable(bounds.axis(axis), d);
    const Interval whole = d.*set;
    const double middle = whole.low + 0.5 * whole.width();
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
