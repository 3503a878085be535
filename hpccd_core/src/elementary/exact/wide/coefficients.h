// SPDX-License-Identifier: Apache-2.0
// Polynomials in t with integer coefficients of any size: values, restriction to a part of the step, remainders.
#pragma once

#include <span>
#include <vector>

#include "elementary/exact/polynomial.h"

namespace hpccd::exact::wide {

using Coefficients = std::span<const Big>;  // of 1, t, t^2, ...; the last one is not zero

inline int degree_of(Coefficients p) { return static_cast<int>(p.size()) - 1; }

template <int D>
Coefficients coefficients(const Polynomial<Big, D>& p) {
  return {p.c.data(), static_cast<std::size_t>(p.degree() + 1)};
}

template <class Number>
std::vector<Number> copied(Coefficients p) {
  std::vector<Number> v;
  for (const Big& c : p) v.emplace_back(c);
  return v;
}

inline std::vector<Big> derivative(Coefficients p) {
  std::vector<Big> d;
  for (int i = 1; i <= degree_of(p); ++i) d.push_back(i * p[i]);
  return d;
}

// p(m / 2^k) 2^(k degree)
inline Big value(Coefficients p, const Big& m, int k) {
  const int n = degree_of(p);
  Big v = p.back();
  for (int i = n; i-- > 0;) v = v * m + (p[i] << (n - i) * k);
  return v;
}

inline int sign_at_dyadic(Coefficients p, const Big& m, int k) { return sign(value(p, m, k)); }

// The sign of den^degree p(num / den), den > 0.
inline int sign_at_ratio(Coefficients p, const Big& num, const Big& den) {
  Big v = p.back(), power = 1;
  for (int i = degree_of(p); i-- > 0;) {
    power *= den;
    v = v * num + p[i] * power;
  }
  return sign(v);
}

// p((base + s) / 2^k) 2^(k degree) as a polynomial in s.
inline std::array<Big, 4> seen_from(Coefficients p, const Big& base, int k) {
  const int n = degree_of(p);
  std::array<Big, 4> a;
  for (int i = 0; i <= n; ++i) a[i] = p[i] << (n - i) * k;
  const Big top = base * a[n];  // reused in every row
  for (int i = 0; i < n; ++i) {
    a[n - 1] += top;
    for (int j = n - 1; j-- > i;) a[j] += base * a[j + 1];
  }
  return a;
}

// The sign that p certainly has on all of [low, high] / 2^k, by its Bernstein coefficients there; 0: not certain.
inline int sign_on(Coefficients p, const Big& low, const Big& high, int k) {
  const int n = degree_of(p);
  std::array<Big, 4> a = seen_from(p, low, k);
  const int s = sign(a[0]);
  Big width = high - low, power = 1;
  for (int i = 1; i <= n; ++i) a[i] *= power *= width;
  Big last = a[0];
  for (int i = 1; i <= n; ++i) last += a[i];
  if (sign(last) != s) return 0;
  // n times those in between.
  const auto agrees = [s](const Big& b) { return sign(b) == s; };
  if (n == 2 && !agrees(2 * a[0] + a[1])) return 0;
  if (n == 3 && !(agrees(3 * a[0] + a[1]) && agrees(3 * a[0] + 2 * a[1] + a[2]))) return 0;
  return s;
}

// A multiple of the remainder of f divided by q, of a degree one below q's; f's degree is at least q's. Leading zeros
// are possible.
template <class Number>
std::vector<Number> pseudo_remainder(std::vector<Number> f, const std::vector<Number>& q) {
  const std::size_t n = q.size();
  while (f.size() >= n) {
    const Number top = f.back();
    const std::size_t shift = f.size() - n;
    for (std::size_t i = 0; i + 1 < f.size(); ++i) {
      f[i] = f[i] * q.back();
      if (i >= shift) f[i] = f[i] - top * q[i - shift];
    }
    f.pop_back();
  }
  return f;
}

}  // namespace hpccd::exact::wide
