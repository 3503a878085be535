// SPDX-License-Identifier: Apache-2.0
// The separation test with 106 bits of precision, for pairs that double precision leaves undecided because the
// features approach each other slowly, or pass each other at a distance very close to the separation.
#pragma once

#include "elementary/distance/separation_test.h"
#include "elementary/extended_precision.h"

namespace hpccd {

// A proof needs only some points of the features: doubles suffice for them (a sixth of the time), if rounding does not
// move them beyond the border.
template <Kind kind>
HPCCD_HD Nearest<DoubleDouble> nearest(const Snapshot<DoubleDouble>& s) {
  using R = DoubleDouble;
  const auto rounded = [](const Vec3<R>& v) { return Vec3<double>{v.x.high, v.y.high, v.z.high}; };
  const detail::Place<double> best =
      detail::best_place<kind>(Snapshot<double>{rounded(s.p), rounded(s.a), rounded(s.b)});
  R x(best.x), y(best.y);
  if (kind == Kind::vertex_face && x + y > R(1)) y = R((1 - best.x) * (1 - 2.220446049250313e-16));
  const detail::Place<R> place{x, y, R(best.over_a), R(best.over_b), best.inside, detail::square_at(s, x, y)};
  return detail::straightened(place, s);
}

namespace extended_precision {

// apart_until: the time up to which a previous test has shown the features to be farther apart than d.
template <Kind kind>
HPCCD_HD Answer earliest_within(const Vec3<double> q_t0[4], const Vec3<double> q_t1[4], double d, double apart_until) {
  const DoubleDouble start(apart_until);
  const Outcome<DoubleDouble> o = separation_test<kind>(motion_of<kind>(q_t0, q_t1), DoubleDouble(d), start);
  return {o.contact, o.none, rounded_towards_zero(o.toc)};
}

// If that time is unknown, it is computed here.
template <Kind kind>
HPCCD_HD Answer earliest_within(const Vec3<double> q_t0[4], const Vec3<double> q_t1[4], double d) {
  const Motion<double> rounded = motion_by<kind, double>([&](int end, int to, int from) {
    const Vec3<double>* q = end ? q_t1 : q_t0;
    return q[to] - q[from];
  });
  return earliest_within<kind>(q_t0, q_t1, d, separation_test<kind>(rounded, d).toc);
}

}  // namespace extended_precision
}  // namespace hpccd
