// SPDX-License-Identifier: Apache-2.0
// A real root in [0, 1] of an integer polynomial, located to 2^-62 by Newton's method on exact values.
#pragma once

#include <limits>

#include "elementary/exact/polynomial.h"
#include "elementary/roots.h"

namespace hpccd::exact {

inline constexpr int time_bits = 62;

HPCCD_HOST_DEVICE inline std::int64_t to_int64(const Integer<1>& x) { return static_cast<std::int64_t>(x.limbs[0]); }

// The only root of `of` within (m, m+1) / 2^k, simple; or, if `exact`, the number m / 2^k itself.
template <class Z, int D>
struct Root {
  Polynomial<Z, D> of;
  Time<Z> m;
  int k;
  bool exact;
  int before;   // the sign of `of` in the interval below the root
  bool linear;  // whether `of` is of degree 1

  // floor(root * 2^62), once it is located.
  HPCCD_HOST_DEVICE std::int64_t time() const { return to_int64(m) << (time_bits - k); }
};

// The coefficients times 2^-exponent, the largest about one, in Bernstein form: for initial guesses.
template <class Z, int D>
HPCCD_HOST_DEVICE_CALL Cubic<double> approximate(const Polynomial<Z, D>& p, int& exponent) {
  double c[4] = {};
  int e[4] = {};
  exponent = std::numeric_limits<int>::min();
  for (int i = 0; i <= D; ++i) {
    c[i] = sign(p.c[i]) * magnitude_of(p.c[i], e[i]);
    if (c[i] != 0) exponent = std::max(exponent, e[i]);
  }
  for (int i = 0; i <= D; ++i) c[i] = std::ldexp(c[i], std::max(e[i] - exponent, -1000));
  return {c[0], 3 * c[0] + c[1], 3 * c[0] + 2 * c[1] + c[2], c[0] + c[1] + c[2] + c[3]};
}

// Narrows (low, high), in units of 2^-62, to a unit interval around its only root, from the guess x. Every step is
// proven by an exact sign; if Newton's method does not converge, bisection does. value(x) is exact; newton(value, x)
// approximates the distance of x above the root. True if `low` is the root itself.
template <class Value, class Newton>
HPCCD_HOST_DEVICE bool close_in(std::int64_t& low, std::int64_t& high, int before, std::int64_t x, Value&& value_there,
                                Newton&& newton) {
  constexpr double most = 0x1p62;
  for (int turn = 0; high - low > 1; ++turn) {
    constexpr int patience = 6;
    if (x <= low || x >= high || turn > patience) x = low + (high - low) / 2;
    const auto value = value_there(x);
    const int s = sign(value);
    if (s == 0) {
      low = x;
      return true;
    }
    (s == before ? low : high) = x;
    const double step = s * newton(value, x);
    // A step that rounds to zero becomes a step to the other side of the root: it closes the interval.
    if (std::fabs(step) < 1)
      x += s == before ? 1 : -1;
    else
      x = std::fabs(step) < most ? x - static_cast<std::int64_t>(step) : low;
  }
  return false;
}

// Narrows the interval to 2^-62.
template <class Z, int D>
HPCCD_HOST_DEVICE_CALL void locate(Root<Z, D>& r) {
  if (r.exact || r.k >= time_bits) return;
  constexpr double unit = 1.0 / (std::int64_t{1} << time_bits);
  std::int64_t low = to_int64(r.m) << (time_bits - r.k), high = low + (std::int64_t{1} << (time_bits - r.k));
  r.k = time_bits;
  int exponent;
  const Cubic<double> f = approximate(r.of, exponent);
  const double guess = bracketed_root(f, 0.0, unit * low, unit * high, static_cast<double>(r.before), true).t;
  const auto value = [&](std::int64_t x) { return value_at(r.of, Time<Z>(x), time_bits); };
  const auto newton = [&](const auto& v, std::int64_t x) {
    int e;
    const double size = magnitude_of(v, e);
    return std::ldexp(size, e - exponent - (D - 1) * time_bits) / slope(f, unit * x);
  };
  r.exact = close_in(low, high, r.before, static_cast<std::int64_t>(guess / unit), value, newton);
  r.m = Time<Z>(low);
}

}  // namespace hpccd::exact
