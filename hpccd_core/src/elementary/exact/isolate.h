// SPDX-License-Identifier: Apache-2.0
// Real roots in [0, 1] of an integer polynomial, isolated by bisection with Descartes' rule on Bernstein coefficients.
#pragma once

#include "elementary/exact/root.h"

namespace hpccd::exact {

namespace detail {

template <class Z>
struct Bernstein {
  int n;
  std::array<Z, 4> b;
  int first_sign() const {
    for (int i = 0; i <= n; ++i)
      if (const int s = sign(b[i])) return s;
    return 0;
  }
  int variations() const {
    int v = 0, last = 0;
    for (int i = 0; i <= n; ++i) {
      const int s = sign(b[i]);
      if (s != 0 && last != 0 && s != last) ++v;
      if (s != 0) last = s;
    }
    return v;
  }
};

inline constexpr int isolation_limbs = 2;
// 40 halvings cost 120 bits and separate roots 1e-12 apart; what is still together probably coincides.
inline constexpr int isolation_depth = 40;

template <class Z, int D>
auto to_bernstein(const Polynomial<Z, D>& p, int degree) {
  using W = Plus<Z, isolation_limbs>;
  const W c0(p.c[0]), c1(p.c[1]);
  if constexpr (D == 3)
    if (degree == 3) {
      const W c2(p.c[2]), c3(p.c[3]), c0_3 = c0 + c0 + c0, sum = c0 + c1 + c2 + c3;
      return Bernstein<W>{3, {c0_3, c0_3 + c1, c0_3 + c1 + c1 + c2, sum + sum + sum}};
    }
  if (degree == 2) {
    const W c2(p.c[2]), c0_2 = c0 + c0, sum = c0 + c1 + c2;
    return Bernstein<W>{2, {c0_2, c0_2 + c1, sum + sum}};
  }
  return Bernstein<W>{1, {c0, c0 + c1}};
}

// Halves of the interval; each is scaled by 2^n, which no sign notices.
template <class Z>
void halve(const Bernstein<Z>& whole, Bernstein<Z>& left, Bernstein<Z>& right) {
  const int n = whole.n;
  left.n = right.n = n;
  std::array<Z, 4> row = whole.b;
  left.b[0] = shifted<0>(row[0], n);
  right.b[n] = shifted<0>(row[n], n);
  for (int level = 1; level <= n; ++level) {
    for (int i = 0; i <= n - level; ++i) row[i] = row[i] + row[i + 1];
    left.b[level] = shifted<0>(row[0], n - level);
    right.b[n - level] = shifted<0>(row[n - level], n - level);
  }
}

}  // namespace detail

// All distinct roots in [0, 1], in order.
template <class Z, int D>
struct Roots {
  std::array<Root<Z, D>, D> root;
  int n = 0;
  bool complete = true;  // false: some were too close to tell apart with integers of this size

  // p must not be constant.
  explicit Roots(const Polynomial<Z, D>& p) { complete = add_all(p, p.degree()); }

 private:
  bool add_all(const Polynomial<Z, D>& p, int degree) {
    if (degree == 2 && discriminant_sign(p) == 0) {
      Polynomial<Z, D> derivative{};
      derivative.c[0] = p.c[1], derivative.c[1] = p.c[2] + p.c[2];
      return add_all(derivative, 1);
    }
    const auto b = detail::to_bernstein(p, degree);
    if (sign(b.b[0]) == 0) add(p, Time<Z>(0), 0, true, 0, degree);
    if (!isolate(p, b, Time<Z>(0), 0)) return false;
    if (sign(b.b[b.n]) == 0) add(p, Time<Z>(1), 0, true, 0, degree);
    return true;
  }

  void add(const Polynomial<Z, D>& p, const Time<Z>& m, int k, bool exact, int before, int degree) {
    root[n++] = {p, m, k, exact, before, degree == 1};
  }

  // Those strictly inside. False where a piece still shows several roots after all halvings.
  template <class W>
  bool isolate(const Polynomial<Z, D>& p, const detail::Bernstein<W>& b, const Time<Z>& m, int k) {
    const int v = b.variations();
    if (v == 1) add(p, m, k, false, b.first_sign(), b.n);
    if (v <= 1) return true;
    if (k == detail::isolation_depth) return false;
    detail::Bernstein<W> left, right;
    detail::halve(b, left, right);
    const Time<Z> first = shifted<0>(m, 1), second = first + Time<Z>(1);
    if (!isolate(p, left, first, k + 1)) return false;
    if (sign(right.b[0]) == 0) add(p, second, k + 1, true, 0, b.n);
    return isolate(p, right, second, k + 1);
  }

  static int discriminant_sign(const Polynomial<Z, D>& p) {
    return sign(p.c[1] * p.c[1] - shifted<0>(p.c[0] * p.c[2], 2));
  }
};

}  // namespace hpccd::exact
