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
  HPCCD_HOST_DEVICE int first_sign() const {
    for (int i = 0; i <= n; ++i)
      if (const int s = sign(b[i])) return s;
    return 0;
  }
  HPCCD_HOST_DEVICE int variations() const {
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
// 40 halvings cost 120 bits and separate roots at a distance of 1e-12; roots that are still together probably coincide.
inline constexpr int isolation_depth = 40;

// For the polynomial of this degree with coefficients c, times the smallest number that keeps all integers.
template <class W>
HPCCD_HOST_DEVICE Bernstein<W> bernstein_of(const std::array<W, 4>& c, int degree) {
  const W &c0 = c[0], &c1 = c[1], &c2 = c[2];
  if (degree == 3) {
    const W c0_3 = c0 + c0 + c0, sum = c0 + c1 + c2 + c[3];
    return {3, {c0_3, c0_3 + c1, c0_3 + c1 + c1 + c2, sum + sum + sum}};
  }
  if (degree == 2) {
    const W c0_2 = c0 + c0, sum = c0 + c1 + c2;
    return {2, {c0_2, c0_2 + c1, sum + sum}};
  }
  return {1, {c0, c0 + c1}};
}

template <class Z, int D>
HPCCD_HOST_DEVICE auto to_bernstein(const Polynomial<Z, D>& p, int degree) {
  using W = Plus<Z, isolation_limbs>;
  std::array<W, 4> c;
  for (int i = 0; i <= D; ++i) c[i] = W(p.c[i]);
  return bernstein_of(c, degree);
}

// On [m, m+1] / 2^k. Each halving scales by 2^degree, which does not affect signs.
template <class Z, int D>
HPCCD_HOST_DEVICE_CALL auto to_bernstein(const Polynomial<Z, D>& p, int degree, std::int64_t m, int k) {
  using W = Plus<Z, isolation_limbs>;
  std::array<W, 4> c;
  for (int i = 0; i <= degree; ++i) c[i] = shifted<0>(W(p.c[i]), (degree - i) * k);
  for (int i = 0; i < degree; ++i)
    for (int j = degree - 1; j >= i; --j) c[j] += scaled(c[j + 1], static_cast<std::uint64_t>(m));
  return bernstein_of(c, degree);
}

template <class Z>
HPCCD_HOST_DEVICE Bernstein<Z> first_half(const Bernstein<Z>& whole) {
  const int n = whole.n;
  Bernstein<Z> first;
  first.n = n;
  std::array<Z, 4> row = whole.b;
  first.b[0] = shifted<0>(row[0], n);
  for (int level = 1; level <= n; ++level) {
    for (int i = 0; i <= n - level; ++i) row[i] = row[i] + row[i + 1];
    first.b[level] = shifted<0>(row[0], n - level);
  }
  return first;
}

}  // namespace detail

// All distinct roots in [0, 1], in order.
template <class Z, int D>
struct Roots {
  std::array<Root<Z, D>, D> root;
  int n = 0;
  bool complete = true;  // false: some roots were too close to be separated with integers of this size

  // p must not be constant.
  HPCCD_HOST_DEVICE explicit Roots(const Polynomial<Z, D>& p) {
    const int degree = p.degree();
    if (degree != 2 || discriminant_sign(p) != 0) {
      complete = add_all(p, degree);
      return;
    }
    Polynomial<Z, D> derivative{};
    derivative.c[0] = p.c[1], derivative.c[1] = p.c[2] + p.c[2];
    complete = add_all(derivative, 1);
  }

 private:
  HPCCD_HOST_DEVICE_CALL bool add_all(const Polynomial<Z, D>& p, int degree) {
    const auto b = detail::to_bernstein(p, degree);
    if (sign(b.b[0]) == 0) add(p, 0, 0, true, 0, degree);
    if (!isolate(p, b)) return false;
    if (sign(b.b[b.n]) == 0) add(p, 1, 0, true, 0, degree);
    return true;
  }

  HPCCD_HOST_DEVICE void add(const Polynomial<Z, D>& p, std::int64_t m, int k, bool exact, int before, int degree) {
    root[n++] = {p, Time<Z>(m), k, exact, before, degree == 1};
  }

  // Roots strictly inside, part after part; without recursion, for which a GPU has no stack. False if a part still has
  // several roots after all halvings.
  template <class W>
  HPCCD_HOST_DEVICE_CALL bool isolate(const Polynomial<Z, D>& p, detail::Bernstein<W> b) {
    const int degree = b.n;
    std::int64_t m = 0;  // the part is [m, m+1] / 2^k
    for (int k = 0;;) {
      const int v = b.variations();
      if (v > 1) {
        if (k == detail::isolation_depth) return false;
        b = detail::first_half(b);
        m *= 2, ++k;
        continue;
      }
      if (v == 1) add(p, m, k, false, b.first_sign(), degree);
      for (; m % 2 != 0; m /= 2) --k;
      if (k == 0) return true;
      ++m;
      b = detail::to_bernstein(p, degree, m, k);
      if (sign(b.b[0]) == 0) add(p, m, k, true, 0, degree);
    }
  }

  HPCCD_HOST_DEVICE static int discriminant_sign(const Polynomial<Z, D>& p) {
    return sign(p.c[1] * p.c[1] - shifted<0>(p.c[0] * p.c[2], 2));
  }
};

}  // namespace hpccd::exact
