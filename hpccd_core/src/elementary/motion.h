// SPDX-License-Identifier: Apache-2.0
// The common configuration of both elementary tests: a connecting vector p and two spanning vectors a, b, each moving
// on a straight line. The features can only touch while p lies in the plane of a and b, at p = alpha a + beta b.
//  vertex-face: p = v - f0, a = f1 - f0, b = f2 - f0; inside where alpha >= 0, beta >= 0, alpha + beta <= 1
//  edge-edge:   p = b0 - a0, a = a1 - a0, b = b1 - b0; inside where 0 <= alpha <= 1, -1 <= beta <= 0
#pragma once

#include "base/vec3.h"

namespace hpccd {

// Edge-face pairs occur in queries of one snapshot only.
enum class Kind : unsigned char { vertex_face, edge_edge, edge_face };

template <class R>
struct Motion {
  Vec3<R> p0, a0, b0;  // at t = 0
  Vec3<R> p1, a1, b1;  // at t = 1
};

// The vertices from which and to which p, a and b lead, among the four vertices in the order of the public queries: v
// f0 f1 f2, or a0 a1 b0 b1.
template <Kind kind>
struct Spans;
template <>
struct Spans<Kind::vertex_face> {
  static constexpr int p_from = 1, p_to = 0, a_from = 1, a_to = 2, b_from = 1, b_to = 3;
};
template <>
struct Spans<Kind::edge_edge> {
  static constexpr int p_from = 0, p_to = 2, a_from = 0, a_to = 1, b_from = 2, b_to = 3;
};

// difference(end, to, from): vertex `to` minus vertex `from`, at t = end.
template <Kind kind, class R, class Difference>
HPCCD_HD Motion<R> motion_by(Difference&& difference) {
  using S = Spans<kind>;
  return {difference(0, S::p_to, S::p_from), difference(0, S::a_to, S::a_from), difference(0, S::b_to, S::b_from),
          difference(1, S::p_to, S::p_from), difference(1, S::a_to, S::a_from), difference(1, S::b_to, S::b_from)};
}

template <Kind kind, class R>
HPCCD_HD Motion<R> motion_of(const Vec3<R> q_t0[4], const Vec3<R> q_t1[4]) {
  return motion_by<kind, R>([&](int end, int to, int from) {
    const Vec3<R>* q = end ? q_t1 : q_t0;
    return q[to] - q[from];
  });
}

// The error of a coordinate of p, a or b before any arithmetic, without the rounding of the difference itself. Doubles
// are the caller's coordinates. Floats are rounded coordinates (scene/vertex_motion.h): they are below 2.25, so each of
// two has an error of half a unit in the last place of four.
template <class R>
HPCCD_HD constexpr double coordinate_error() {
  return sizeof(typename RealTraits<R>::Scalar) == 4 ? 2.4e-7 : 0;
}

// Largest coordinates of p, a and b over the motion: the scale of every error bound.
template <class R>
struct Magnitudes {
  R p, a, b;
};

template <class R>
HPCCD_HD Magnitudes<R> magnitudes(const Motion<R>& m) {
  Magnitudes<R> size{greater(max_norm(m.p0), max_norm(m.p1)), greater(max_norm(m.a0), max_norm(m.a1)),
                     greater(max_norm(m.b0), max_norm(m.b1))};
  if constexpr (coordinate_error<R>() > 0) {  // errors of the true ones
    const R by(coordinate_error<R>());
    size = {size.p + by, size.a + by, size.b + by};
  }
  return size;
}

// Whether products of four magnitudes neither overflow nor lose bits to underflow, so that the relative error bounds
// hold. The limits allow for degree-4 terms of doubles: (2^-240)^4 = 2^-960, far above the smallest normal number.
// False for NaN.
template <class R>
HPCCD_HD typename RealTraits<R>::Mask in_range(const Magnitudes<R>& m) {
  using Traits = RealTraits<R>;
  // Compared with the error of rounded coordinates, whose range is known, losses by underflow are negligible.
  if constexpr (coordinate_error<R>() > 0) return R(0) < R(1);
  double low = 5.7e-73, high = 1.7e72;  // 2^-240, 2^240
  if constexpr (requires { Traits::least_usable; }) low = Traits::least_usable, high = Traits::most_usable;
  const R least = lesser(lesser(m.p, m.a), m.b);
  const R most = greater(greater(m.p, m.a), m.b);
  return least >= R(low) && most <= R(high);
}

}  // namespace hpccd
