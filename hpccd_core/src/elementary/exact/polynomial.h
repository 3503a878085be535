// SPDX-License-Identifier: Apache-2.0
// Polynomials in t of degree at most 3 with integer coefficients: sums, products, signs.
#pragma once

#include "elementary/exact/integers.h"

namespace hpccd::exact {

// A polynomial of degree at most D.
template <class Z, int D>
struct Polynomial {
  std::array<Z, D + 1> c;  // coefficient of t^i

  // -1 for the zero polynomial.
  HPCCD_HOST_DEVICE int degree() const {
    int d = D;
    while (d >= 0 && sign(c[d]) == 0) --d;
    return d;
  }
};

template <class Z, int D>
HPCCD_HOST_DEVICE Polynomial<Z, D> operator+(const Polynomial<Z, D>& a, const Polynomial<Z, D>& b) {
  Polynomial<Z, D> s;
  for (int i = 0; i <= D; ++i) s.c[i] = a.c[i] + b.c[i];
  return s;
}
template <class Z, int D>
HPCCD_HOST_DEVICE Polynomial<Z, D> operator-(const Polynomial<Z, D>& a, const Polynomial<Z, D>& b) {
  Polynomial<Z, D> s;
  for (int i = 0; i <= D; ++i) s.c[i] = a.c[i] - b.c[i];
  return s;
}
template <class Z, int D>
HPCCD_HOST_DEVICE Polynomial<Z, D> operator-(const Polynomial<Z, D>& a) {
  Polynomial<Z, D> s;
  for (int i = 0; i <= D; ++i) s.c[i] = -a.c[i];
  return s;
}
template <class X, class Y>
HPCCD_HOST_DEVICE auto operator*(const Polynomial<X, 1>& a, const Polynomial<Y, 1>& b)
    -> Polynomial<decltype(a.c[0] * b.c[0]), 2> {
  return {{a.c[0] * b.c[0], a.c[0] * b.c[1] + a.c[1] * b.c[0], a.c[1] * b.c[1]}};
}
template <class X, class Y>
HPCCD_HOST_DEVICE auto operator*(const Polynomial<X, 1>& a, const Polynomial<Y, 2>& b)
    -> Polynomial<decltype(a.c[0] * b.c[0]), 3> {
  return {{a.c[0] * b.c[0], a.c[0] * b.c[1] + a.c[1] * b.c[0], a.c[0] * b.c[2] + a.c[1] * b.c[1], a.c[1] * b.c[2]}};
}

template <class X, int A, class Y, int B>
HPCCD_HOST_DEVICE auto operator*(const Polynomial<X, A>& a, const Polynomial<Y, B>& b)
    -> Polynomial<decltype(a.c[0] * b.c[0]), A + B> {
  Polynomial<decltype(a.c[0] * b.c[0]), A + B> product;
  for (int k = 0; k <= A + B; ++k) {
    const int first = std::max(0, k - B), last = std::min(A, k);
    product.c[k] = a.c[first] * b.c[k - first];
    for (int i = first + 1; i <= last; ++i) product.c[k] = product.c[k] + a.c[i] * b.c[k - i];
  }
  return product;
}

// p(m / 2^k) 2^(k D), by Horner's rule from coefficient I upwards.
template <int I = 0, class Z, int D, class M>
HPCCD_HOST_DEVICE auto value_at(const Polynomial<Z, D>& p, const M& m, int k) {
  if constexpr (I == D)
    return p.c[D];
  else
    return value_at<I + 1>(p, m, k) * m + shifted<D - I>(p.c[I], (D - I) * k);
}

template <class Z, int D, class M>
HPCCD_HOST_DEVICE_CALL int sign_at_dyadic(const Polynomial<Z, D>& p, const M& m, int k) {
  return sign(value_at(p, m, k));
}

// The sign of den^D p(num / den).
template <class Z, int D, class Q>
HPCCD_HOST_DEVICE_CALL int sign_at_ratio(const Polynomial<Z, D>& p, const Q& num, const Q& den) {
  const auto den2 = den * den, num2 = num * num;
  if constexpr (D == 2)
    return sign(p.c[0] * den2 + p.c[1] * (num * den) + p.c[2] * num2);
  else
    return sign(p.c[0] * (den * den2) + p.c[1] * (num * den2) + p.c[2] * (num2 * den) + p.c[3] * (num2 * num));
}

// The sign that p certainly has on all of [m, m+1] / 2^k, by its Bernstein coefficients there; 0: not certain.
template <class Z, class M>
HPCCD_HOST_DEVICE_CALL int sign_on_dyadic(const Polynomial<Z, 2>& p, const M& m, int k) {
  const auto left = value_at(p, m, k);
  const int s = sign(left);
  if (s == 0) return 0;
  // Half of this is the difference of the middle and the left coefficient.
  const auto rise = shifted<1>(p.c[1], k) + shifted<0>(p.c[2] * m, 1);
  if (sign(shifted<0>(left, 1) + rise) != s) return 0;
  return sign(left + rise + p.c[2]) == s ? s : 0;
}

// Converts coefficients of degree n to Bernstein coefficients times binomial coefficients.
template <class Number>
HPCCD_HOST_DEVICE void to_bernstein(Number* a, int n) {
  for (int i = 0; i < n; ++i)
    for (int j = 1; j <= n - i; ++j) a[j] += a[j - 1];
}

// The remainder of q2^2 f divided by q, whose leading coefficient is not zero.
template <class X, class Y>
HPCCD_HOST_DEVICE auto pseudo_remainder(const Polynomial<X, 3>& f, const Polynomial<Y, 2>& q) {
  const auto g0 = q.c[2] * f.c[0], g1 = q.c[2] * f.c[1] - f.c[3] * q.c[0], g2 = q.c[2] * f.c[2] - f.c[3] * q.c[1];
  const auto r0 = q.c[2] * g0 - g2 * q.c[0];
  return Polynomial<std::remove_const_t<decltype(r0)>, 1>{{r0, q.c[2] * g1 - g2 * q.c[1]}};
}

}  // namespace hpccd::exact
