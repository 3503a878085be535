// SPDX-License-Identifier: Apache-2.0
// Polynomials of degree at most 3 with integer coefficients, in powers of t.
#pragma once

#include <array>

#include "elementary/exact/integers.h"

namespace hpccd::exact {

template <class Z>
struct Polynomial {
  int degree = -1;  // -1: zero throughout
  std::array<Z, 4> c{};

  void trim() {
    degree = 3;
    while (degree >= 0 && sign(c[degree]) == 0) --degree;
  }
};

template <class Z>
Polynomial<Z> polynomial(Z c0, Z c1 = 0, Z c2 = 0, Z c3 = 0) {
  Polynomial<Z> p;
  p.c = {std::move(c0), std::move(c1), std::move(c2), std::move(c3)};
  p.trim();
  return p;
}

// The sign of p(m / 2^k).
template <class Z>
int sign_at_dyadic(const Polynomial<Z>& p, const Z& m, int k) {
  if (p.degree < 0) return 0;
  Z sum = p.c[p.degree];
  for (int i = p.degree - 1, shift = k; i >= 0; --i, shift += k) sum = sum * m + (p.c[i] << shift);
  return sign(sum);
}

// The sign that p certainly has on the whole of [m, m+1] / 2^k by its Bernstein coefficients there; 0: not certain.
// Only for degree <= 2, the degree of everything whose sign the inside conditions ask for.
template <class Z>
int sign_on_dyadic(const Polynomial<Z>& p, const Z& m, int k) {
  if (p.degree < 0) return 0;
  const Z one_c1 = p.c[1] << k;
  const Z left = (p.c[0] << 2 * k) + one_c1 * m + p.c[2] * m * m;
  const int s = sign(left);
  if (s == 0) return 0;
  const Z rise = one_c1 + 2 * p.c[2] * m;  // half of it is what the middle coefficient lies above the left one
  if (sign(Z(2 * left + rise)) != s) return 0;
  return sign(Z(left + rise + p.c[2])) == s ? s : 0;
}

// Greatest common divisor up to a constant factor, by pseudo-remainders made primitive on the way.
inline Polynomial<Big> primitive(Polynomial<Big> p) {
  Big g = 0;
  for (const Big& c : p.c) g = boost::multiprecision::gcd(g, c);
  if (g > 1)
    for (Big& c : p.c) c /= g;
  p.trim();
  return p;
}

inline Polynomial<Big> greatest_common_divisor(Polynomial<Big> a, Polynomial<Big> b) {
  if (a.degree < b.degree) std::swap(a, b);
  a = primitive(a);
  b = primitive(b);
  while (b.degree >= 0) {
    while (a.degree >= b.degree && a.degree >= 0) {
      const Big la = a.c[a.degree], lb = b.c[b.degree];
      const int shift = a.degree - b.degree;
      for (Big& c : a.c) c *= lb;
      for (int i = 0; i <= b.degree; ++i) a.c[i + shift] -= la * b.c[i];
      a = primitive(a);
    }
    std::swap(a, b);
  }
  return a;
}

inline Polynomial<Big> derivative(const Polynomial<Big>& p) {
  return polynomial<Big>(p.c[1], 2 * p.c[2], 3 * p.c[3]);
}

// a / b where b divides a (up to a constant factor).
inline Polynomial<Big> quotient(Polynomial<Big> a, const Polynomial<Big>& b) {
  Polynomial<Big> q;
  while (a.degree >= b.degree) {
    const Big la = a.c[a.degree], lb = b.c[b.degree];
    const int shift = a.degree - b.degree;
    for (Big& c : a.c) c *= lb;
    for (Big& c : q.c) c *= lb;
    q.c[shift] += la;
    for (int i = 0; i <= b.degree; ++i) a.c[i + shift] -= la * b.c[i];
    a.trim();
    if (a.degree < 0) break;
  }
  q.trim();
  return primitive(q);
}

inline Polynomial<Big> square_free(const Polynomial<Big>& p) {
  return p.degree < 2 ? p : quotient(p, greatest_common_divisor(p, derivative(p)));
}

template <class Z>
Polynomial<Big> to_big(const Polynomial<Z>& p) {
  return polynomial<Big>(Big(p.c[0]), Big(p.c[1]), Big(p.c[2]), Big(p.c[3]));
}

}  // namespace hpccd::exact
