// SPDX-License-Identifier: Apache-2.0
// The coplanarity cubic f(t) = p(t) . (a(t) x b(t)) (Provot 1997; Kim et al. 2009, section 3.1) in Bernstein form,
//   f(t) = c0 (1-t)^3 + k1 (1-t)^2 t + k2 (1-t) t^2 + c3 t^3      (k1, k2 are three times the Bernstein coefficients),
// with bounds of its rounding errors. Bernstein form keeps the endpoints exact and bounds f by its coefficients.
#pragma once

#include "elementary/motion.h"

namespace hpccd {

template <class R>
struct Cubic {
  R c0, k1, k2, c3;
};

// u is half an ulp of one (2^-53, 2^-24). With M = |p||a||b| in the maximum norm and differences of coordinates that
// carry one rounding each, counting roundings along the longest path gives
//   c0, c3: 3 terms of size 2M, each with at most 8 roundings                    -> below  48 u M
//   k1, k2: 3 terms of 4M with 9 roundings and 3 of 2M with 8, and their sum      -> below 174 u M
// The constants are rounded up, which also covers second-order terms and the rounding of M itself.
template <class R>
struct CubicError {
  R coefficient;  // of c0, c3, and of the true Bernstein coefficients k1/3, k2/3
  R value;        // of value(f, t)
  R subdivided;   // of Bernstein coefficients after subdivision
};

template <class R>
HPCCD_HD constexpr double half_ulp() {
  if constexpr (requires { RealTraits<R>::half_ulp; }) return RealTraits<R>::half_ulp;
  return sizeof(typename RealTraits<R>::Scalar) == 8 ? 1.1102230246251565e-16 : 5.9604644775390625e-08;
}

template <class R>
HPCCD_HD Cubic<R> coplanarity(const Motion<R>& m) {
  const Vec3<R> n00 = cross(m.a0, m.b0), n11 = cross(m.a1, m.b1);
  const Vec3<R> n01 = cross(m.a0, m.b1) + cross(m.a1, m.b0);
  return {dot(m.p0, n00), dot(m.p0, n01) + dot(m.p1, n00), dot(m.p1, n01) + dot(m.p0, n11), dot(m.p1, n11)};
}

template <class R>
HPCCD_HD CubicError<R> coplanarity_error(const Magnitudes<R>& m) {
  const R scale = m.p * m.a * m.b;
  // value: with x = t (1-t) <= 1/4 the coefficients' errors weigh 48 (1-3x) + 174 x <= 56 u M; the evaluation has at
  // most 9 roundings on terms whose magnitudes sum up to 6 M: 54 u M. Together 110 u M.
  // Two subdivisions: 64 u M, 12 u M for thirds of k1 and k2, two times three interpolations with 4 roundings of 6 M:
  // 220 u M; the second split point is rounded by 3 u, where |f'| <= 36 M: 328 u M in all.
  CubicError<R> e{R(64 * half_ulp<R>()) * scale, R(112 * half_ulp<R>()) * scale, R(400 * half_ulp<R>()) * scale};
  if constexpr (coordinate_error<R>() > 0) {
    // Bounds the error of a determinant's six products with one inaccurate factor each; a Bernstein coefficient is a
    // mean of such determinants, and a value of f is a mean of coefficients.
    const R off = R(6 * coordinate_error<R>()) * (m.p * m.a + m.p * m.b + m.a * m.b);
    e = {e.coefficient + off, e.value + off, e.subdivided + off};
  }
  return e;
}

template <class R>
HPCCD_HD R value(const Cubic<R>& f, R t) {
  const R s = R(1) - t;
  return s * (s * (s * f.c0 + t * f.k1) + t * t * f.k2) + t * t * t * f.c3;
}

template <class R>
HPCCD_HD R slope(const Cubic<R>& f, R t) {
  const R s = R(1) - t;
  return s * s * (f.k1 - R(3) * f.c0) + R(2) * s * t * (f.k2 - f.k1) + t * t * (R(3) * f.c3 - f.k2);
}

// True if all Bernstein coefficients certainly have the same sign: f has no root in [0, 1].
template <class R>
HPCCD_HD typename RealTraits<R>::Mask certainly_no_root(const Cubic<R>& f, R error) {
  const R e3 = R(3) * error;
  const R low = lesser(lesser(f.c0, f.c3) * R(3), lesser(f.k1, f.k2));
  const R high = greater(greater(f.c0, f.c3) * R(3), greater(f.k1, f.k2));
  return low > e3 || high < R(0) - e3;
}

}  // namespace hpccd
