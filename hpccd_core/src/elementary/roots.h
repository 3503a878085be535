// SPDX-License-Identifier: Apache-2.0
// Roots of the coplanarity cubic: the parts of [0, 1] that certainly contain exactly one root, and the position of
// that root.
#pragma once

#include "elementary/coplanarity.h"

namespace hpccd {

// Normalised to begin positive, the coefficients change sign exactly once, whatever the uncertain ones are: f has
// exactly one root in the part, and it is simple (Descartes' rule for Bernstein coefficients).
template <class R>
HPCCD_HD typename RealTraits<R>::Mask certainly_one_root(const Cubic<R>& f, R error) {
  const R sign = select(f.c0 < R(0), R(-1), R(1));
  const R e3 = R(3) * error;
  return sign * f.c0 > error && sign * f.c3 < R(0) - error && (sign * f.k1 > e3 || sign * f.k2 < R(0) - e3);
}

template <class R>
struct Pieces {
  Cubic<R> left, right;
};

// de Casteljau's algorithm at t.
template <class R>
HPCCD_HD Pieces<R> subdivide(const Cubic<R>& f, R t) {
  const R s = R(1) - t;
  R third(1.0 / 3.0);
  if constexpr (requires { RealTraits<R>::half_ulp; }) third = R(1) / R(3);  // more bits than a double has
  const R b0 = f.c0, b1 = third * f.k1, b2 = third * f.k2, b3 = f.c3;
  const R m01 = s * b0 + t * b1, m12 = s * b1 + t * b2, m23 = s * b2 + t * b3;
  const R l2 = s * m01 + t * m12, r1 = s * m12 + t * m23;
  const R mid = s * l2 + t * r1;
  return {{b0, R(3) * m01, R(3) * l2, mid}, {mid, R(3) * r1, R(3) * m23, b3}};
}

// The extrema of f inside (0, 1), in order; without extrema, its point of inflection (a monotone cubic split there has
// monotone Bernstein coefficients on both sides); outside (0, 1) or undefined: one half.
template <class R>
struct TurningPoints {
  R first, second;
};

template <class R>
HPCCD_HD R inside_unit_or(R t, R otherwise) {
  return select(t > R(1e-9) && t < R(1.0 - 1e-9), t, otherwise);
}

template <class R>
HPCCD_HD TurningPoints<R> turning_points(const Cubic<R>& f) {
  const R d0 = f.k1 - R(3) * f.c0, d1 = f.k2 - f.k1, d2 = R(3) * f.c3 - f.k2;
  const R a = d0 - R(2) * d1 + d2, b = d1 - d0;
  const R discriminant = b * b - a * d0;
  const R root = square_root(greater(discriminant, R(0)));
  const R q = R(0) - select(b < R(0), b - root, b + root);
  const R inflection = inside_unit_or((R(0) - b) / a, R(0.5));
  const R x = inside_unit_or(q / a, R(-1)), y = inside_unit_or(d0 / q, R(-1));
  const auto turns = discriminant > R(0);
  // If x or y is outside, both become the other one, so that the middle part is empty.
  const R first = select(x < R(0), y, select(y < R(0), x, lesser(x, y)));
  const R second = greater(x, y);
  const auto usable = turns && second > R(0);
  return {select(usable, first, inflection), select(usable, second, inflection)};
}

template <class R>
struct Root {
  R t, delta;                            // the true root is within delta of t
  typename RealTraits<R>::Mask certain;  // ... which signs on both sides have proven
};

// The root of f in [low, high], which contains exactly one, with f(low) of sign `sign`. Newton's method is kept inside
// a shrinking bracket. Each lane stops by its own criterion, so its result does not depend on other lanes: when a step
// is at rounding level, or below `enough`. Starting point for more bits than doubles have: the root in double
// precision, two of Newton's steps away from the result.
template <class R>
HPCCD_HD R first_guess(const Cubic<R>& f, R low, R high, R sign);

template <class R>
HPCCD_HD Root<R> bracketed_root(const Cubic<R>& f, R error, R low, R high, R sign, typename RealTraits<R>::Mask active,
                                double enough = 0) {
  using Mask = typename RealTraits<R>::Mask;
  const R eps(half_ulp<R>()), least_step = greater(R(2) * eps, R(enough));
  const R begin = low, end = high;
  R t = first_guess(f, low, high, sign);
  R step = high - low;
  Mask running = active;
  // As many bisections as a double has bits, and some more: a root that is not found by then is reported as uncertain
  // below.
  constexpr int most_steps = 80;
  for (int i = 0; i < most_steps && any(running); ++i) {
    const R ft = sign * value(f, t);
    const R newton = ft / (sign * slope(f, t));
    const Mask before = ft > R(0);
    low = select(running && before, t, low);
    high = select(running && !before, t, high);
    const R guess = t - newton;
    const Mask converged = magnitude(newton) <= least_step;
    // Newton's step must stay inside and at most half as long as the last step. Written so that NaN leads to bisection.
    const Mask good = converged || (guess > low && guess < high && magnitude(newton) < R(0.5) * step);
    const R next = select(good, guess, R(0.5) * (low + high));
    const R moved = magnitude(next - t);
    t = select(running, next, t);
    step = select(running, moved, step);
    running = running && !converged && moved > least_step;
  }
  t = lesser(greater(t, begin), end);
  const R flat = magnitude(slope(f, t));
  R delta = R(8) * eps + R(2.1) * error / flat;
  const R left = greater(t - delta, begin), right = lesser(t + delta, end);
  const Mask left_sure = left <= begin || sign * value(f, left) > error;
  const Mask right_sure = right >= end || sign * value(f, right) < R(0) - error;
  return {t, delta, left_sure && right_sure};
}

template <class R>
HPCCD_HD R first_guess(const Cubic<R>& f, R low, R high, R sign) {
  const R middle = R(0.5) * (low + high);
  if constexpr (requires { RealTraits<R>::half_ulp; }) {
    const Cubic<double> g{f.c0.high, f.k1.high, f.k2.high, f.c3.high};
    const R root(bracketed_root(g, 0.0, low.high, high.high, sign.high, true).t);
    return root > low && root < high ? root : middle;
  }
  return middle;
}

}  // namespace hpccd
