// SPDX-License-Identifier: Apache-2.0
// Real roots in [0, 1] of an integer polynomial, isolated by bisection with Descartes' rule on Bernstein coefficients,
// and the sign of another polynomial at such a root.
#pragma once

#include <vector>

#include "elementary/exact/polynomial.h"

namespace hpccd::exact {

// The only root of `of` in [m, m+1] / 2^k, simple; or, where `rational`, the number m / 2^k itself.
template <class Z>
struct IsolatedRoot {
  Polynomial<Z> of;
  Z m;
  int k = 0;
  bool rational = false;
  int before = 0;  // the sign of `of` in the interval below the root

  // Rounded down, for m / 2^k in [0, 1].
  double lower() const {
    const int excess = k - 62;
    if (excess <= 0) return std::ldexp(round_down(static_cast<std::uint64_t>(m)), -k);
    return std::ldexp(round_down(static_cast<std::uint64_t>(Z(m >> excess))), -62);
  }

  void bisect() {
    const Z middle = 2 * m + 1;
    const int at_middle = sign_at_dyadic(of, middle, k + 1);
    ++k;
    if (at_middle == 0) {
      m = middle;
      rational = true;
      return;
    }
    m = at_middle == before ? middle : Z(2 * m);
  }

  void refine_to(int bits) {
    while (!rational && k < bits) bisect();
  }

 private:
  static double round_down(std::uint64_t x) {
    const int spare = 64 - 53 - (x ? __builtin_clzll(x) : 64);
    if (spare > 0) x = (x >> spare) << spare;
    return static_cast<double>(x);
  }
};

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

template <class Z>
Bernstein<Z> to_bernstein(const Polynomial<Z>& p) {
  const auto& c = p.c;
  switch (p.degree) {
    case 3: return {3, {3 * c[0], 3 * c[0] + c[1], 3 * c[0] + 2 * c[1] + c[2], 3 * (c[0] + c[1] + c[2] + c[3])}};
    case 2: return {2, {2 * c[0], 2 * c[0] + c[1], 2 * (c[0] + c[1] + c[2])}};
    case 1: return {1, {c[0], c[0] + c[1]}};
    default: return {0, {c[0]}};
  }
}

// Halves of the interval; each is scaled by 2^n, which no sign notices.
template <class Z>
void halve(const Bernstein<Z>& whole, Bernstein<Z>& left, Bernstein<Z>& right) {
  const int n = whole.n;
  left.n = right.n = n;
  std::array<Z, 4> row = whole.b;
  left.b[0] = row[0] << n;
  right.b[n] = row[n] << n;
  for (int level = 1; level <= n; ++level) {
    for (int i = 0; i <= n - level; ++i) row[i] = row[i] + row[i + 1];
    left.b[level] = row[0] << (n - level);
    right.b[n - level] = row[n - level] << (n - level);
  }
}

// False where a piece still shows several roots after `depth` halvings: roots that coincide, or nearly.
template <class Z>
bool isolate(const Polynomial<Z>& p, const Bernstein<Z>& b, Z m, int k, int depth, std::vector<IsolatedRoot<Z>>& roots) {
  const int v = b.variations();
  if (sign(b.b[0]) == 0) roots.push_back({p, m, k, true});
  if (v == 1) {
    roots.push_back({p, m, k, false, b.first_sign()});
    return true;
  }
  if (v == 0) return true;
  if (k == depth) return false;
  Bernstein<Z> left, right;
  halve(b, left, right);
  // Each piece reports a root at its left end; drop the copy that the whole has reported already.
  const auto before = roots.size();
  if (!isolate(p, left, Z(2 * m), k + 1, depth, roots)) return false;
  if (sign(b.b[0]) == 0) roots.erase(roots.begin() + static_cast<std::ptrdiff_t>(before));
  return isolate(p, right, Z(2 * m + 1), k + 1, depth, roots);
}

template <class Z>
bool isolate_unit(const Polynomial<Z>& p, int depth, std::vector<IsolatedRoot<Z>>& roots) {
  const auto b = to_bernstein(p);
  if (!isolate(p, b, Z(0), 0, depth, roots)) return false;
  if (sign(b.b[b.n]) == 0) roots.push_back({p, Z(1), 0, true});
  return true;
}

}  // namespace detail

// All distinct roots of p (not zero throughout) in [0, 1], in order.
template <class Z>
std::vector<IsolatedRoot<Z>> roots_in_unit(const Polynomial<Z>& p) {
  std::vector<IsolatedRoot<Z>> roots;
  if (p.degree <= 0) return roots;
  // 40 halvings cost 120 bits and separate roots 1e-12 apart; what is still together probably coincides.
  if (detail::isolate_unit(p, 40, roots)) return roots;
  std::vector<IsolatedRoot<Big>> big;
  detail::isolate_unit(square_free(to_big(p)), 1 << 20, big);
  roots.clear();
  // The coefficients of a square-free part are divisors of p's up to small factors, so they fit Z again.
  for (const auto& r : big)
    roots.push_back({polynomial<Z>(Z(r.of.c[0]), Z(r.of.c[1]), Z(r.of.c[2]), Z(r.of.c[3])), Z(r.m), r.k, r.rational, r.before});
  return roots;
}

// The sign of q (degree <= 2) at the root. Refines the root where that decides.
template <class Z>
int sign_at(const Polynomial<Z>& q, IsolatedRoot<Z>& root) {
  if (q.degree <= 0) return q.degree < 0 ? 0 : sign(q.c[0]);
  if (root.rational) return sign_at_dyadic(q, root.m, root.k);
  for (int bits : {16, 64}) {
    root.refine_to(bits);
    if (root.rational) return sign_at_dyadic(q, root.m, root.k);
    if (const int s = sign_on_dyadic(q, root.m, root.k)) return s;
  }
  IsolatedRoot<Big> big{to_big(root.of), Big(root.m), root.k, false, root.before};
  const Polynomial<Big> q_big = to_big(q), g = greatest_common_divisor(big.of, q_big);
  while (sign_at_dyadic(big.of, big.m, big.k) == 0 || sign_at_dyadic(big.of, Big(big.m + 1), big.k) == 0) {
    big.bisect();
    if (big.rational) return sign_at_dyadic(q_big, big.m, big.k);
  }
  // The root of `of` in the interval is the only one and simple, so a common divisor that vanishes there changes sign.
  if (g.degree >= 1 && sign_at_dyadic(g, big.m, big.k) * sign_at_dyadic(g, Big(big.m + 1), big.k) < 0) return 0;
  for (;;) {
    big.bisect();
    if (big.rational) return sign_at_dyadic(q_big, big.m, big.k);
    if (const int s = sign_on_dyadic(q_big, big.m, big.k)) return s;
  }
}

}  // namespace hpccd::exact
