// SPDX-License-Identifier: Apache-2.0
// The side from which the features approach each other, in integers of one type: the sign of f = p . n just before the
// contact, and n at the contact.
#pragma once

#include <optional>

#include "elementary/exact/contact.h"
#include "elementary/exact/isolate.h"
#include "elementary/exact/query.h"
#include "elementary/exact/sign_at_root.h"

namespace hpccd::exact {

namespace detail {

// The sign of f next to m / 2^k, by its lowest derivative that does not vanish; direction is 1 or -1. Before t = 0 and
// after t = 1 the motion continues on its straight lines.
template <class Z, class M>
HPCCD_HOST_DEVICE_CALL int sign_beside(const Polynomial<Z, 3>& f, const M& m, int k, int direction) {
  if (const int s = sign_at_dyadic(f, m, k)) return s;
  using W = Plus<Z, 1>;  // three times a coefficient may need one more bit
  const W c1(f.c[1]), c2(f.c[2]), c3(f.c[3]);
  const Polynomial<W, 2> slope{{c1, c2 + c2, c3 + c3 + c3}};
  if (const int s = sign_at_dyadic(slope, m, k)) return direction * s;
  const Polynomial<W, 1> curvature{{c2, c3 + c3 + c3}};
  if (const int s = sign_at_dyadic(curvature, m, k)) return s;
  return direction * sign(f.c[3]);
}

template <class Z, int D>
HPCCD_HOST_DEVICE int sign_before(const Polynomial<Z, 3>& f, const Root<Z, D>& root) {
  // The interval of an inexact root contains no other root.
  return root.exact ? sign_beside(f, root.m, root.k, -1) : sign_beside(f, root.m, root.k, 1);
}

// n_k as floating-point numbers with one common scale; `low` is the power of two of each axis. sign_of(k) returns the
// sign of n_k.
template <class Z, class M, class Sign>
HPCCD_HOST_DEVICE Vec3<double> direction(const Query<Z>& q, const int low[3], const M& m, int k, Sign&& sign_of) {
  double fraction[3] = {};
  int exponent[3] = {}, most = std::numeric_limits<int>::min();
  for (int axis = 0; axis < 3; ++axis) {
    const int s = sign_of(axis);
    if (s == 0) continue;
    fraction[axis] = s * magnitude_of(value_at(q.n[axis], m, k), exponent[axis]);
    exponent[axis] -= low[axis];
    most = std::max(most, exponent[axis]);
  }
  const auto scaled = [&](int axis) {
    return fraction[axis] == 0 ? 0 : std::ldexp(fraction[axis], std::max(exponent[axis] - most, -2000));
  };
  return {scaled(0), scaled(1), scaled(2)};
}

// Which of the roots of f, given by their times, belongs to the contact at `toc`: among those within `same_time` the
// first at which the features touch; otherwise the nearest one, if the features are known to touch. -1: none.
template <class Touches>
HPCCD_HOST_DEVICE int root_of_contact(const std::int64_t* times, int n, std::int64_t toc, Touches&& touches_at) {
  // More than twice the radius of a proven time of contact (Proven::toc_radius), by which the conservative tier reports
  // it early.
  constexpr std::int64_t same_time = std::int64_t{1} << (time_bits - 38);  // 3.6e-12
  const auto distance = [&](int i) { return times[i] < toc ? toc - times[i] : times[i] - toc; };
  int nearest = -1;
  for (int i = 0; i < n; ++i)
    if (nearest < 0 || distance(i) < distance(nearest)) nearest = i;
  for (int i = 0; i < n; ++i)
    if (distance(i) <= same_time && touches_at(i)) return i;
  return nearest;
}

// For features that are apart: no root of f belongs to a contact.
template <class Z>
HPCCD_HOST_DEVICE Approach approach_between_roots(const Query<Z>& q, const int low[3], std::int64_t toc) {
  const Time<Z> m(toc);
  return {sign_beside(q.f, m, time_bits, -1),
          direction(q, low, m, time_bits, [&](int k) { return sign_at_dyadic(q.n[k], m, time_bits); })};
}

}  // namespace detail

HPCCD_HOST_DEVICE inline std::int64_t time_of(double toc) {
  return static_cast<std::int64_t>(std::ldexp(toc, time_bits));
}

// Nothing if integers of this size leave it undecided.
template <class Z>
HPCCD_HOST_DEVICE_CALL std::optional<Approach> approach(const Query<Z>& q, const int low[3], double toc) {
  const int degree = q.f.degree();
  if (degree < 0) return Approach{0, {0, 0, 0}};
  if (degree == 0) return detail::approach_between_roots(q, low, time_of(toc));
  Roots roots(q.f);
  if (!roots.complete) return std::nullopt;
  std::int64_t times[3];
  for (int i = 0; i < roots.n; ++i) {
    locate(roots.root[i]);
    times[i] = roots.root[i].time();
  }
  bool open = false;
  const auto sign_there = [&](const auto& p, int i) { return open ? 0 : sign_at(p, roots.root[i], open); };
  const auto touches_at = [&](int i) { return touches(q, [&](const auto& p) { return sign_there(p, i); }) || open; };
  const int i = detail::root_of_contact(times, roots.n, time_of(toc), touches_at);
  if (i < 0) return detail::approach_between_roots(q, low, time_of(toc));
  int sign_of_n[3];
  for (int k = 0; k < 3; ++k) sign_of_n[k] = sign_there(q.n[k], i);
  if (open) return std::nullopt;
  const auto& root = roots.root[i];
  return Approach{detail::sign_before(q.f, root),
                  detail::direction(q, low, root.m, root.k, [&](int k) { return sign_of_n[k]; })};
}

}  // namespace hpccd::exact
