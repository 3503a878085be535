// SPDX-License-Identifier: Apache-2.0
// The position of p in the plane of a and b: with n = a x b, alpha n = p x b and beta n = a x p.
#pragma once

#include "elementary/coplanarity.h"
#include "elementary/policy.h"

namespace hpccd {

// Outcomes of a test with bounded rounding errors.
template <class R>
struct Verdict {
  using Mask = typename RealTraits<R>::Mask;
  Mask yes, no;  // neither: undecided
};

template <class R>
HPCCD_HD Vec3<R> interpolate(Vec3<R> v0, Vec3<R> v1, R t) {
  return (R(1) - t) * v0 + t * v1;
}

// A weight x / n in [0, 1], for signed n. yes: certainly 0 <= x <= n. no: x is certainly beyond both 0 and n, on the
// same side. The latter does not need a certain n: if n vanishes at a contact, so does x.
template <class R>
HPCCD_HD void require_between(Verdict<R>& all, R x, R n, R error) {
  const R d = x - n;
  all.yes = all.yes && lesser(x, R(0) - d) > error;
  all.no = all.no || lesser(x, d) > error || greater(x, d) < R(0) - error;
}

// The coordinate in which cross products are largest: the conditions of motion.h hold in each coordinate, and rounding
// matters least in this one.
template <class R>
struct LargestCoordinate {
  typename RealTraits<R>::Mask is_x, is_y;  // neither: z

  HPCCD_HD LargestCoordinate(const Vec3<R>& u, const Vec3<R>& v, const Vec3<R>& w) {
    const R x = magnitude(u.x) + magnitude(v.x) + magnitude(w.x);
    const R y = magnitude(u.y) + magnitude(v.y) + magnitude(w.y);
    const R z = magnitude(u.z) + magnitude(v.z) + magnitude(w.z);
    is_x = x >= y && x >= z, is_y = !is_x && y >= z;
  }
  HPCCD_HD R pick(R for_x, R for_y, R for_z) const { return select(is_x, for_x, select(is_y, for_y, for_z)); }
};

// The conditions of motion.h in the coordinate in which the cross products are largest, valid for a contact anywhere
// within delta of t.
//
// Bounds: interpolated coordinates have 4 rounding errors, a component of a cross product two products of 10: 20 u MM.
// It changes by at most 8 MM per unit of time. The rest of 24 u and 9 delta covers the rounding errors of sums. In each
// of the two products one factor may have an initial error (coordinate_error).
template <Kind kind, class Policy, class R>
HPCCD_HD Verdict<R> inside(const Motion<R>& m, const Magnitudes<R>& size, R t, R delta) {
  const Vec3<R> p = interpolate(m.p0, m.p1, t), a = interpolate(m.a0, m.a1, t), b = interpolate(m.b0, m.b1, t);
  const Vec3<R> ab = cross(a, b), pb = cross(p, b), ap = cross(a, p);
  const LargestCoordinate<R> largest(ab, pb, ap);
  const auto component = [&](const Vec3<R>& v) { return largest.pick(v.x, v.y, v.z); };
  const R signed_n = component(ab);
  const R sign = select(signed_n < R(0), R(-1), R(1));
  const R n = sign * signed_n, alpha = sign * component(pb), beta = sign * component(ap);
  const R relative =
      Policy::borders_inside ? R(-24 * Policy::border * half_ulp<R>()) : R(24 * half_ulp<R>()) + R(9) * delta;
  R e_n = relative * size.a * size.b, e_alpha = relative * size.p * size.b, e_beta = relative * size.a * size.p;
  if constexpr (coordinate_error<R>() > 0) {
    const R off(2 * coordinate_error<R>() * (Policy::borders_inside ? -Policy::border : 1));
    e_n = e_n + off * (size.a + size.b), e_alpha = e_alpha + off * (size.p + size.b);
    e_beta = e_beta + off * (size.a + size.p);
  }
  Verdict<R> v{n > magnitude(e_n), R(1) < R(0)};
  if constexpr (kind == Kind::vertex_face) {
    require_between(v, alpha, n, e_n + e_alpha);
    require_between(v, beta, n, e_n + e_beta);
    require_between(v, n - alpha - beta, n, e_n + e_alpha + e_beta);
  } else {
    require_between(v, alpha, n, e_n + e_alpha);
    require_between(v, R(0) - beta, n, e_n + e_beta);
  }
  if constexpr (Policy::borders_inside) v.no = n > magnitude(e_n) && !v.yes;
  return v;
}

// The same "no" for the whole step at once: beyond both 0 and n throughout. Quadratics in Bernstein form. Bounds:
// products of two differences with 4 rounding errors, 2 of them in q0, q2 (8 u MM) and 4 in q1 (20 u MM).
template <class R>
struct Quadratic {
  R q0, q1, q2;  // q1 is twice the Bernstein coefficient
  HPCCD_HD friend Quadratic operator+(Quadratic a, Quadratic b) { return {a.q0 + b.q0, a.q1 + b.q1, a.q2 + b.q2}; }
  HPCCD_HD friend Quadratic operator-(Quadratic a, Quadratic b) { return {a.q0 - b.q0, a.q1 - b.q1, a.q2 - b.q2}; }
};

template <class R>
HPCCD_HD R least(const Quadratic<R>& q) {
  return lesser(lesser(q.q0, q.q2), R(0.5) * q.q1);
}

template <class R>
HPCCD_HD R most(const Quadratic<R>& q) {
  return greater(greater(q.q0, q.q2), R(0.5) * q.q1);
}

template <class R>
HPCCD_HD Quadratic<R> planar_cross(R ux0, R uy0, R ux1, R uy1, R vx0, R vy0, R vx1, R vy1) {
  return {ux0 * vy0 - uy0 * vx0, (ux0 * vy1 - uy0 * vx1) + (ux1 * vy0 - uy1 * vx0), ux1 * vy1 - uy1 * vx1};
}

// x is certainly above both 0 and y, or below both, throughout; `error` bounds the error of each and of their
// difference.
template <class R>
HPCCD_HD typename RealTraits<R>::Mask beyond(const Quadratic<R>& x, const Quadratic<R>& y, R error) {
  const Quadratic<R> d = x - y;
  return lesser(least(x), least(d)) > error || greater(most(x), most(d)) < R(0) - error;
}

template <Kind kind, class R>
HPCCD_HD typename RealTraits<R>::Mask certainly_outside(const Motion<R>& m, const Magnitudes<R>& size) {
  // The coordinate in which the cross products are largest at mid-step: the projection along it is tested.
  const Vec3<R> p = m.p0 + m.p1, a = m.a0 + m.a1, b = m.b0 + m.b1;
  const LargestCoordinate<R> dropped(cross(a, b), cross(p, b), cross(a, p));
  // (y, z), (z, x) or (x, y): the order that gives the component of the cross product its sign.
  const auto first = [&](const Vec3<R>& v) { return dropped.pick(v.y, v.z, v.x); };
  const auto second = [&](const Vec3<R>& v) { return dropped.pick(v.z, v.x, v.y); };
  const R px0 = first(m.p0), py0 = second(m.p0), px1 = first(m.p1), py1 = second(m.p1);
  const R ax0 = first(m.a0), ay0 = second(m.a0), ax1 = first(m.a1), ay1 = second(m.a1);
  const R bx0 = first(m.b0), by0 = second(m.b0), bx1 = first(m.b1), by1 = second(m.b1);
  const Quadratic<R> n = planar_cross(ax0, ay0, ax1, ay1, bx0, by0, bx1, by1);
  const Quadratic<R> alpha = planar_cross(px0, py0, px1, py1, bx0, by0, bx1, by1);
  const Quadratic<R> beta = planar_cross(ax0, ay0, ax1, ay1, px0, py0, px1, py1);
  // 10 u for each Bernstein coefficient, doubled for the rounding errors of sums.
  const R u(32 * half_ulp<R>());
  R e_n = u * size.a * size.b, e_alpha = u * size.p * size.b, e_beta = u * size.a * size.p;
  if constexpr (coordinate_error<R>() > 0) {
    const R off(2 * coordinate_error<R>());
    e_n = e_n + off * (size.a + size.b), e_alpha = e_alpha + off * (size.p + size.b);
    e_beta = e_beta + off * (size.a + size.p);
  }
  const Quadratic<R> zero{R(0), R(0), R(0)};
  if constexpr (kind == Kind::vertex_face)
    return beyond(alpha, n, e_n + e_alpha) || beyond(beta, n, e_n + e_beta) ||
           beyond(n - alpha - beta, n, e_n + e_alpha + e_beta);
  else
    return beyond(alpha, n, e_n + e_alpha) || beyond(zero - beta, n, e_n + e_beta);
}

}  // namespace hpccd
