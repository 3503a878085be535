// SPDX-License-Identifier: Apache-2.0
// A real number as the sum of two doubles, 106 bits (Dekker 1971; algorithms and bounds of Joldes, Muller and Popescu,
// "Tight and rigorous error bounds for basic building blocks of double-word arithmetic", 2017). Uses only +, -, *,
// fma, so it is bit-identical on every machine.
#pragma once

#include "base/real.h"

namespace hpccd {

struct DoubleDouble {
  double high, low;
  DoubleDouble() = default;
  HPCCD_HD explicit DoubleDouble(double x) : high(x), low(0) {}
  HPCCD_HD DoubleDouble(double h, double l) : high(h), low(l) {}
};

namespace detail {

HPCCD_HD DoubleDouble two_sum(double a, double b) {
  const double s = a + b, x = s - b, y = s - x;
  return {s, (a - x) + (b - y)};
}
HPCCD_HD DoubleDouble fast_two_sum(double a, double b) {
  const double s = a + b;
  return {s, b - (s - a)};
}
HPCCD_HD DoubleDouble two_product(double a, double b) {
  const double p = a * b;
  return {p, fma(a, b, -p)};
}

}  // namespace detail

// Relative errors in units of 2^-106: sum 3, product 5, quotient 10 (theorems 3.1, 5.3 and 6.2); all below 2^-102.
HPCCD_HD DoubleDouble operator+(DoubleDouble a, DoubleDouble b) {
  const DoubleDouble s = detail::two_sum(a.high, b.high), t = detail::two_sum(a.low, b.low);
  const DoubleDouble v = detail::fast_two_sum(s.high, s.low + t.high);
  return detail::fast_two_sum(v.high, t.low + v.low);
}
HPCCD_HD DoubleDouble operator-(DoubleDouble a) { return {-a.high, -a.low}; }
HPCCD_HD DoubleDouble operator-(DoubleDouble a, DoubleDouble b) { return a + -b; }
HPCCD_HD DoubleDouble operator*(DoubleDouble a, DoubleDouble b) {
  const DoubleDouble c = detail::two_product(a.high, b.high);
  const double cross = fma(a.low, b.high, fma(a.high, b.low, a.low * b.low));
  return detail::fast_two_sum(c.high, c.low + cross);
}
HPCCD_HD DoubleDouble operator/(DoubleDouble a, DoubleDouble b) {
  const double t = a.high / b.high;
  // The remainder a - t b, in which the high parts cancel exactly.
  const DoubleDouble r = detail::two_product(b.high, t);
  const double rest = ((a.high - r.high) - r.low) + fma(-t, b.low, a.low);
  return detail::fast_two_sum(t, rest / b.high);
}

HPCCD_HD bool operator<(DoubleDouble a, DoubleDouble b) {
  return a.high < b.high || (a.high == b.high && a.low < b.low);
}
HPCCD_HD bool operator>(DoubleDouble a, DoubleDouble b) { return b < a; }
HPCCD_HD bool operator<=(DoubleDouble a, DoubleDouble b) {
  return a.high < b.high || (a.high == b.high && a.low <= b.low);
}
HPCCD_HD bool operator>=(DoubleDouble a, DoubleDouble b) { return b <= a; }

HPCCD_HD DoubleDouble select(bool m, DoubleDouble a, DoubleDouble b) { return m ? a : b; }

// The position of a polynomial's root is proven afterwards by signs: this is only a guess with twice the precision.
HPCCD_HD DoubleDouble square_root(DoubleDouble a) {
  if (!(a.high > 0)) return DoubleDouble(0);
  const double r = sqrt(a.high);
  const DoubleDouble square = detail::two_product(r, r);
  return detail::fast_two_sum(r, ((a.high - square.high) - square.low + a.low) / (2 * r));
}

template <>
struct RealTraits<DoubleDouble> {
  using Scalar = DoubleDouble;
  using Mask = bool;
  static constexpr int width = 1;
  static constexpr double half_ulp = 1.9721522630525295e-31;             // 2^-102
  static constexpr double least_usable = 6.3e-61, most_usable = 1.7e72;  // 2^-200, 2^240
};

}  // namespace hpccd
