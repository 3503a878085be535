// SPDX-License-Identifier: Apache-2.0
// The sign of a quadratic at a root of another polynomial.
#pragma once

#include "elementary/exact/root.h"

namespace hpccd::exact {

enum class Known { no, yes, unknown };

// Whether p, of degree 1, vanishes strictly inside (m, m+1) / 2^k.
template <class P, class M>
HPCCD_HOST_DEVICE bool vanishes_inside(const P& p, const M& m, int k) {
  return sign_at_dyadic(p, m, k) * sign_at_dyadic(p, M(m + M(1)), k) < 0;
}

// Whether q, not constant, vanishes at the root, which is not exact. Unknown if the root's interval is too wide.
template <class Y, class Z, int D>
HPCCD_HOST_DEVICE_CALL Known vanishes_at(const Polynomial<Y, 2>& q, const Root<Z, D>& root) {
  Polynomial<Z, 3> f{};
  for (int i = 0; i <= 3; ++i) f.c[i] = i <= D ? root.of.c[std::min(i, D)] : Z(0);
  const auto known = [](bool b) { return b ? Known::yes : Known::no; };
  if (q.degree() == 1) {
    const Polynomial<Y, 1> line{{q.c[0], q.c[1]}};
    return known(vanishes_inside(line, root.m, root.k) && sign_at_ratio(f, Y(-q.c[0]), q.c[1]) == 0);
  }
  // A common root of both is a root of the remainder.
  const auto r = pseudo_remainder(f, q);
  if (r.degree() == 0) return Known::no;
  if (r.degree() == 1) {
    const auto minus_r0 = -r.c[0];
    return known(vanishes_inside(r, root.m, root.k) && sign_at_ratio(q, minus_r0, r.c[1]) == 0);
  }
  // q divides f, of which the interval contains one simple root: if q vanishes there, it changes sign.
  const int s = sign_at_dyadic(q, root.m, root.k) * sign_at_dyadic(q, Time<Z>(root.m + Time<Z>(1)), root.k);
  return s == 0 ? Known::unknown : known(s < 0);
}

// Narrows the root if that helps. Some signs remain undecided: then `open` is set.
template <class Y, class Z, int D>
HPCCD_HOST_DEVICE_CALL int sign_at(const Polynomial<Y, 2>& q, Root<Z, D>& root, bool& open) {
  const int degree = q.degree();
  if (degree <= 0) return degree < 0 ? 0 : sign(q.c[0]);
  if (root.exact) return sign_at_dyadic(q, root.m, root.k);
  if (root.linear) return sign_at_ratio(q, -root.of.c[0], root.of.c[1]);
  locate(root);
  if (root.exact) return sign_at_dyadic(q, root.m, root.k);
  if (const int s = sign_on_dyadic(q, root.m, root.k)) return s;
  if (vanishes_at(q, root) != Known::yes) open = true;
  return 0;
}

}  // namespace hpccd::exact
