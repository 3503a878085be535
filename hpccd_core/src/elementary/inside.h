// SPDX-License-Identifier: Apache-2.0
// Where p lies in the plane of a and b: with n = a x b, alpha n = p x b and beta n = a x p.
#pragma once

#include "elementary/coplanarity.h"

namespace hpccd {

// Verdicts of a test that knows its own rounding errors.
template <class R>
struct Verdict {
  using Mask = typename RealTraits<R>::Mask;
  Mask yes, no;  // neither: undecided
};

template <class R>
HPCCD_HD Vec3<R> interpolate(Vec3<R> v0, Vec3<R> v1, R t) {
  return (R(1) - t) * v0 + t * v1;
}

template <class R>
HPCCD_HD void require_nonnegative(Verdict<R>& all, R x, R error) {
  all.yes = all.yes && x > error;
  all.no = all.no || x < R(0) - error;
}

// The conditions of motion.h, multiplied by the positive number |n|^2 and evaluated at t; sound for a contact anywhere
// within delta of t.
//
// Bounds: interpolated vectors carry 5 roundings and stay within their maximum M, a component of a cross product is
// below 2 MM with 12 roundings per product, a dot product of two crosses below 12 MMMM with 27: 12 * 27 = 324 u MMMM.
// A vector moves by at most 2 M per unit of time, so a product of four by 4 * 2 * 12 = 96 MMMM delta.
template <Kind kind, class R>
HPCCD_HD Verdict<R> inside(const Motion<R>& m, const Magnitudes<R>& size, R t, R delta) {
  const Vec3<R> p = interpolate(m.p0, m.p1, t), a = interpolate(m.a0, m.a1, t), b = interpolate(m.b0, m.b1, t);
  const Vec3<R> n = cross(a, b);
  const R d = dot(n, n), alpha = dot(cross(p, b), n), beta = dot(cross(a, p), n);
  const R relative = R(400 * half_ulp<R>()) + R(100) * delta;
  const R ab = size.a * size.b;
  const R e_d = relative * ab * ab, e_alpha = relative * size.p * size.b * ab, e_beta = relative * size.a * size.p * ab;
  Verdict<R> v{d > e_d, R(1) < R(0)};
  if constexpr (kind == Kind::vertex_face) {
    require_nonnegative(v, alpha, e_alpha);
    require_nonnegative(v, beta, e_beta);
    require_nonnegative(v, d - alpha - beta, e_d + e_alpha + e_beta);
  } else {
    require_nonnegative(v, alpha, e_alpha);
    require_nonnegative(v, d - alpha, e_d + e_alpha);
    require_nonnegative(v, R(0) - beta, e_beta);
    require_nonnegative(v, d + beta, e_d + e_beta);
  }
  // Where n may vanish the conditions say nothing: neither yes nor no.
  v.no = v.no && d > e_d;
  return v;
}

// Proves that p stays outside during the whole step: one coordinate k in which n keeps a certain sign while one of the
// conditions is violated throughout. Quadratics in Bernstein form (coefficients q0, q1/2, q2).
// Bounds: products of two differences with 4 roundings, 2 of them in q0, q2 (8 u MM) and 4 in q1 (20 u MM).
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

template <Kind kind, class R>
HPCCD_HD typename RealTraits<R>::Mask certainly_outside(const Motion<R>& m, const Magnitudes<R>& size) {
  using Mask = typename RealTraits<R>::Mask;
  // The coordinate in which the mean normal is largest: drop it and look at the projection.
  const Vec3<R> n = cross(m.a0 + m.a1, m.b0 + m.b1);
  const R nx = magnitude(n.x), ny = magnitude(n.y), nz = magnitude(n.z);
  const Mask drop_x = nx >= ny && nx >= nz, drop_y = !drop_x && ny >= nz;
  // (y, z), (z, x) or (x, y): the order that gives the component of the cross product its sign.
  const auto first = [&](const Vec3<R>& v) { return select(drop_x, v.y, select(drop_y, v.z, v.x)); };
  const auto second = [&](const Vec3<R>& v) { return select(drop_x, v.z, select(drop_y, v.x, v.y)); };
  const R px0 = first(m.p0), py0 = second(m.p0), px1 = first(m.p1), py1 = second(m.p1);
  const R ax0 = first(m.a0), ay0 = second(m.a0), ax1 = first(m.a1), ay1 = second(m.a1);
  const R bx0 = first(m.b0), by0 = second(m.b0), bx1 = first(m.b1), by1 = second(m.b1);
  Quadratic<R> nk = planar_cross(ax0, ay0, ax1, ay1, bx0, by0, bx1, by1);
  Quadratic<R> alpha = planar_cross(px0, py0, px1, py1, bx0, by0, bx1, by1);
  Quadratic<R> beta = planar_cross(ax0, ay0, ax1, ay1, px0, py0, px1, py1);
  const R u(16 * half_ulp<R>());
  const R e_n = u * size.a * size.b, e_alpha = u * size.p * size.b, e_beta = u * size.a * size.p;
  const Mask positive = least(nk) > e_n, negative = most(nk) < R(0) - e_n;
  const R sign = select(negative, R(-1), R(1));
  nk = {sign * nk.q0, sign * nk.q1, sign * nk.q2};
  alpha = {sign * alpha.q0, sign * alpha.q1, sign * alpha.q2};
  beta = {sign * beta.q0, sign * beta.q1, sign * beta.q2};
  Mask violated;
  if constexpr (kind == Kind::vertex_face) {
    const R e_sum = R(2) * (e_n + e_alpha + e_beta);
    violated = most(alpha) < R(0) - e_alpha || most(beta) < R(0) - e_beta || most(nk - alpha - beta) < R(0) - e_sum;
  } else {
    violated = most(alpha) < R(0) - e_alpha || most(nk - alpha) < R(0) - R(2) * (e_n + e_alpha) ||
               least(beta) > e_beta || most(nk + beta) < R(0) - R(2) * (e_n + e_beta);
  }
  return violated && (positive || negative);
}

}  // namespace hpccd
