// SPDX-License-Identifier: Apache-2.0
// The nearest parts of two features at rest (resting.h): their positions and their distance.
#pragma once

#include <cmath>
#include <limits>

#include "elementary/exact/resting.h"

namespace hpccd::exact {

// sqrt(num / den) 2^low, rounded.
inline double root_of_ratio(const Big& num, const Big& den, int low) {
  if (num.is_zero()) return 0;
  // Bits of the ratio: twice as many as its root needs, which has more than a double.
  constexpr int bits = 124;
  int scale = bits - (highest_bit(num) - highest_bit(den));
  scale += scale % 2 != 0;
  const Big ratio = scale >= 0 ? Big((num << scale) / den) : Big(num / (den << -scale));
  const double root = std::ldexp(static_cast<double>(static_cast<std::uint64_t>(sqrt(ratio))), low - scale / 2);
  return root > 0 ? root : std::numeric_limits<double>::denorm_min();
}

// x / y, with about two rounding errors; y > 0.
template <class X, class Y>
double ratio(const X& x, const Y& y) {
  int ex, ey;
  const double fraction = magnitude_of(x, ex) / magnitude_of(y, ey);
  return sign(x) * std::ldexp(fraction, std::max(ex - ey, -2000));
}

// p = alpha a + beta b (motion.h) for nearest points inside; otherwise a point and a position on a segment.
struct Place {
  enum { inside, on_segment, at_end } where = at_end;
  double alpha = 0, beta = 0;
  int segment = 0;
  double along = 0;  // 0 at the segment's start, 1 at its end
};

// The smallest squared distance.
template <class Z>
struct Least {
  using Square = decltype(Z() * Z());
  using Fourth = decltype(Square() * Square());
  Fourth num{};
  Square den{};  // of points and segments
  bool any = false;
  Big plane_num, plane_den;
  Place place;

  template <class N, class D>
  bool planes(const N& num_, const D& den_, const D& alpha, const D& beta) {
    plane_num = to_big(num_), plane_den = to_big(den_);
    place = {Place::inside, ratio(alpha, den_), ratio(beta, den_), 0, 0};
    return false;
  }
  bool line(const Fourth& n, const Square& d, const Square& along, int i) {
    if (improve(n, d)) place = {Place::on_segment, 0, 0, i, ratio(along, d)};
    return true;
  }
  bool points(const Square& n, int i, int end) {
    if (improve(Fourth(n), Square(1))) place = {Place::at_end, 0, 0, i, static_cast<double>(end)};
    return true;
  }
  bool improve(const Fourth& n, const Square& d) {
    if (any && sign(n * den - num * d) >= 0) return false;
    num = n, den = d, any = true;
    return true;
  }
  double distance(int low) const {
    return place.where == Place::inside ? root_of_ratio(plane_num, plane_den, low)
                                        : root_of_ratio(to_big(num), to_big(den), low);
  }
};

}  // namespace hpccd::exact
