// SPDX-License-Identifier: Apache-2.0
// The contact point and the normal of two features at their time of impact. On CPUs and devices.
#pragma once

#include "contacts/arbiters.h"
#include "contacts/face_place.h"
#include "contacts/meeting_point.h"
#include "elementary/inside.h"

namespace hpccd {

// Keeps references to the vertices, which are in the order of motion.h.
template <Kind kind>
class ContactPoint {
  using V = Vec3<double>;

 public:
  HPCCD_HD ContactPoint(const V t0[4], const V t1[4], double toc)
      : t0_(t0),
        t1_(t1),
        t_(toc),
        m_(motion_of<kind>(t0, t1)),
        p_(interpolate(m_.p0, m_.p1, toc)),
        a_(interpolate(m_.a0, m_.a1, toc)),
        b_(interpolate(m_.b0, m_.b1, toc)),
        n_(cross(a_, b_)),
        nn_(dot(n_, n_)) {
    const Magnitudes<double> size{greater(largest(m_.p1), largest(m_.p0)), greater(largest(m_.a1), largest(m_.a0)),
                                  greater(largest(m_.b1), largest(m_.b0))};
    product_ = size.p * size.a * size.b;
    // If the sine of the angle between a and b, relative to their largest lengths in the step, is below this, rounding
    // errors of n (20 u) are no longer small compared with n.
    constexpr double flat = 1e-6;
    regular_ = in_range(size) && largest(n_) > flat * (size.a * size.b);
  }

  // Where the features touch. For parallel edges the middle of their overlap.
  HPCCD_HOST_DEVICE Places places() const {
    if constexpr (kind == Kind::edge_edge) return crossing();
    if (!regular_) return face_place(p_, a_, b_);
    // On a short side the place may be any, within roundings of p: only what the other leaves is its.
    const double per_nn = 1 / nn_;
    const double alpha = clamped(per_nn * dot(cross(p_, b_), n_)), beta = clamped(per_nn * dot(cross(a_, p_), n_));
    if (largest(a_) < largest(b_)) return {lesser(1 - beta, alpha), beta};
    return {alpha, lesser(1 - alpha, beta)};
  }

  // The vertex; or the point of the shorter edge. The numbering of vertices and the order of edges affect neither this
  // nor the normal.
  HPCCD_HOST_DEVICE V point(Places places) const {
    if (kind == Kind::vertex_face) return at(0);
    return a_shorter() ? at(0) + places.alpha * a_ : at(2) + -places.beta * b_;
  }

  // Unit length, at toc: perpendicular to the face, towards the side of the vertex just before toc, or a x b, from a
  // towards the side of b just before toc. For a contact at t = 0, "just before" refers to the straight-line motion
  // continued backwards. Zero if there is no side, because the motion is coplanar throughout, or no direction, because
  // features are degenerate or parallel at toc.
  template <class Arbiter>
  HPCCD_HOST_DEVICE V normal(Arbiter& arbiter) const {
    if (const int side = regular_ ? certain_side() : 0) return (side / sqrt(nn_)) * n_;
    const exact::Approach a = arbiter.approach(kind, t0_, t1_, t_);
    return a.side * unit(a.n);
  }

 private:
  HPCCD_HD V at(int i) const { return interpolate(t0_[i], t1_[i], t_); }

  // The side of n on which p is just before the contact; 0: not certain. With f = p . n and M = |p||a||b|: |f| <= 6 M,
  // |f'| <= 36 M, |f''| <= 144 M. Counting rounding errors as in coplanarity.h, f is known to 108 u M and f' to 600 u
  // M.
  HPCCD_HD int certain_side() const {
    const double f = dot(p_, n_), error = 1.5e-14 * product_;
    const V da = m_.a1 - m_.a0, db = m_.b1 - m_.b0;
    const double slope = dot(m_.p1 - m_.p0, n_) + dot(p_, cross(da, b_) + cross(a_, db));
    // The root of f that belongs to the contact is within the rounding error of its time; in tiers that do not promise
    // times, about f / f' away. If f' keeps its sign up to twice as far (Kantorovich), f comes from the opposite side.
    constexpr double time_error = 4e-12;
    const double steep = fabs(slope) - 1.2e-13 * product_;
    if (!(steep > 0 && steep * steep > 150 * product_ * (time_error * steep + 2 * (fabs(f) + error)))) return 0;
    return slope < 0 ? 1 : -1;
  }

  HPCCD_HD bool a_shorter() const { return largest(a_) < largest(b_); }

  // First on the shorter edge: a point within rounding errors of it need not be within 1e-9 of the longer edge's length
  // on that one.
  HPCCD_HOST_DEVICE Places crossing() const {
    if (regular_) {
      const double per_nn = 1 / nn_;
      const double on_a = clamped(per_nn * dot(cross(p_, b_), n_)), on_b = clamped(per_nn * dot(cross(p_, a_), n_));
      // A gap perpendicular to both edges does not affect the point.
      const V gap = p_ + on_b * b_ - on_a * a_, along = gap - (per_nn * dot(gap, n_)) * n_;
      if (largest(along) <= 1e-10 * greater(largest(b_), largest(a_))) return {on_a, -on_b};
    }
    const Segment a{{0, 0, 0}, a_}, b{p_, b_};
    if (a_shorter()) {
      const double on_a = meeting_place(b, a);
      return {on_a, -nearest_place(b, a.at(on_a))};
    }
    const double on_b = meeting_place(a, b);
    return {nearest_place(a, b.at(on_b)), -on_b};
  }

  const V *t0_, *t1_;
  double t_;
  Motion<double> m_;
  V p_, a_, b_, n_;  // at the time of contact: as in motion.h, and a x b
  double nn_;        // |n|^2
  double product_;   // |p||a||b|, the largest values of the step in the maximum norm
  bool regular_;     // doubles can hold all products, and n is accurate
};

}  // namespace hpccd
