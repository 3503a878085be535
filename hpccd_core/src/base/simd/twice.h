// SPDX-License-Identifier: Apache-2.0
// Two registers of lanes side by side, for arithmetic with long dependency chains: while one waits for its division,
// the other one computes.
#pragma once

#include "base/simd/lanes.h"

namespace hpccd {

template <class Mask>
struct TwiceMask {
  Mask a, b;
  HPCCD_HD friend TwiceMask operator&&(TwiceMask x, TwiceMask y) { return {x.a && y.a, x.b && y.b}; }
  HPCCD_HD friend TwiceMask operator||(TwiceMask x, TwiceMask y) { return {x.a || y.a, x.b || y.b}; }
  HPCCD_HD friend TwiceMask operator!(TwiceMask x) { return {!x.a, !x.b}; }
};

template <class R>
struct Twice {
  using Mask = TwiceMask<typename R::Mask>;
  R a, b;
  HPCCD_HD Twice() = default;
  HPCCD_HD Twice(R x, R y) : a(x), b(y) {}
  HPCCD_HD explicit Twice(double x) : a(x), b(x) {}
  HPCCD_HD friend Twice operator+(Twice x, Twice y) { return {x.a + y.a, x.b + y.b}; }
  HPCCD_HD friend Twice operator-(Twice x, Twice y) { return {x.a - y.a, x.b - y.b}; }
  HPCCD_HD friend Twice operator*(Twice x, Twice y) { return {x.a * y.a, x.b * y.b}; }
  HPCCD_HD friend Twice operator/(Twice x, Twice y) { return {x.a / y.a, x.b / y.b}; }
  HPCCD_HD friend Mask operator<(Twice x, Twice y) { return {x.a < y.a, x.b < y.b}; }
  HPCCD_HD friend Mask operator>(Twice x, Twice y) { return {x.a > y.a, x.b > y.b}; }
  HPCCD_HD friend Mask operator<=(Twice x, Twice y) { return {x.a <= y.a, x.b <= y.b}; }
  HPCCD_HD friend Mask operator>=(Twice x, Twice y) { return {x.a >= y.a, x.b >= y.b}; }
};

template <class R>
HPCCD_HD Twice<R> select(TwiceMask<typename R::Mask> m, Twice<R> x, Twice<R> y) {
  return {select(m.a, x.a, y.a), select(m.b, x.b, y.b)};
}
template <class R>
HPCCD_HD Twice<R> magnitude(Twice<R> x) {
  return {magnitude(x.a), magnitude(x.b)};
}
template <class R>
HPCCD_HD Twice<R> square_root(Twice<R> x) {
  return {square_root(x.a), square_root(x.b)};
}
template <class Mask>
HPCCD_HD bool any(TwiceMask<Mask> m) {
  return any(m.a || m.b);
}
template <class T, int W>
HPCCD_HD unsigned bits(TwiceMask<LaneMask<T, W>> m) {
  return bits(m.a) | bits(m.b) << W;
}

template <class R>
struct RealTraits<Twice<R>> {
  using Scalar = typename RealTraits<R>::Scalar;
  using Mask = typename Twice<R>::Mask;
  static constexpr int width = 2 * RealTraits<R>::width;
};

}  // namespace hpccd
