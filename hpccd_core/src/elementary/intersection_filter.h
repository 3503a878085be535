// SPDX-License-Identifier: Apache-2.0
// The edge-face intersection test of one snapshot as a floating-point filter: yes, no or undecided. The first two are
// proven by forward error bounds.
#pragma once

#include "elementary/inside.h"

namespace hpccd {

// Vectors from the face's first corner to the edge's ends p and r, and to the face's other corners a and b. Each
// coordinate is the rounded difference of two given ones.
template <class R>
struct EdgeFace {
  Vec3<R> p, r, a, b;
};

template <class R>
HPCCD_HD EdgeFace<R> edge_face(const Vec3<R> q[5]) {
  return {q[0] - q[2], q[1] - q[2], q[3] - q[2], q[4] - q[2]};
}

// The largest coordinates of each vector: the scale of every error bound. Volumes below are products of three of them,
// which in_range allows for: (2^-240)^3 is so far above the smallest double that its error bound exceeds all losses by
// underflow.
template <class R>
struct EdgeFaceSize {
  R p, r, a, b;
  typename RealTraits<R>::Mask usable;

  HPCCD_HD explicit EdgeFaceSize(const EdgeFace<R>& q)
      : p(max_norm(q.p)), r(max_norm(q.r)), a(max_norm(q.a)), b(max_norm(q.b)) {
    const R least = lesser(lesser(p, r), lesser(a, b)), most = greater(greater(p, r), greater(a, b));
    usable = in_range(Magnitudes<R>{least, most, most});
  }
};

// The test by signs of volumes. height_p and height_r are the heights of the edge's ends above the face's plane. alpha,
// beta and gamma, whose sum is d = height_r - height_p, tell on which side of the edge's line the face's edges pass. If
// a point q of the line is in the face, q = alpha/d a + beta/d b. For any q = x a + y b of the line, degenerate cases
// included, alpha = x d, beta = y d and gamma = (1 - x - y) d. So if two of these four numbers have opposite signs, the
// line misses the face.
//
// Bounds: with differences that have one rounding error each, a volume is 3 terms of 2 |.||.||.| with 8 rounding
// errors: 48 u M. d adds one, gamma two to each of the four volumes in it: 60 u M. The rest of 64 covers second-order
// terms and the rounding errors of M itself.
template <class R>
HPCCD_HD Verdict<R> volume_test(const EdgeFace<R>& q) {
  const EdgeFaceSize<R> size(q);
  const Vec3<R> n = cross(q.a, q.b), m = cross(q.p, q.r);
  const R height_p = dot(q.p, n), height_r = dot(q.r, n);
  const R alpha = R(0) - dot(q.b, m), beta = dot(q.a, m);
  const R d = height_r - height_p, gamma = d - (alpha + beta);

  const R ab = R(64 * half_ulp<R>()) * size.a * size.b, pr = R(64 * half_ulp<R>()) * size.p * size.r;
  const R e_p = ab * size.p, e_r = ab * size.r, e_alpha = pr * size.b, e_beta = pr * size.a;
  const R e_d = e_p + e_r, e_gamma = e_d + e_alpha + e_beta, zero(0);
  const auto p_above = height_p > e_p, r_above = height_r > e_r;
  const auto p_below = height_p < zero - e_p, r_below = height_r < zero - e_r;
  const auto alpha_above = alpha > e_alpha, alpha_below = alpha < zero - e_alpha;
  const auto beta_above = beta > e_beta, beta_below = beta < zero - e_beta;
  const auto gamma_above = gamma > e_gamma, gamma_below = gamma < zero - e_gamma;

  const auto crosses = (p_above && r_below) || (p_below && r_above);
  const auto inside = (alpha_above && beta_above && gamma_above) || (alpha_below && beta_below && gamma_below);
  const auto beside = (p_above && r_above) || (p_below && r_below);
  const auto outside = (alpha_above || beta_above || gamma_above || d > e_d) &&
                       (alpha_below || beta_below || gamma_below || d < zero - e_d);
  return {size.usable && crosses && inside, size.usable && (beside || outside)};
}

// Pairs that volumes leave undecided lie nearly in one plane. In the projection along the axis along which the face has
// the largest area, the two are certainly apart if one of the lines of their four sides has the other figure beyond it:
// a condition that holds in any projection of any two such figures.
//
// Bounds: areas, as two products of differences with 4 rounding errors, have 8 u M; in sums of three of them each has
// 6: 12 u M. Every sum below contains an area of a kind at most twice; 32 covers that, the rounding of a limit itself
// and second-order terms.
template <class R>
HPCCD_HD typename RealTraits<R>::Mask certainly_apart_in_projection(const EdgeFace<R>& q) {
  const EdgeFaceSize<R> size(q);
  const Vec3<R> ab = cross(q.a, q.b), pb = cross(q.p, q.b), ap = cross(q.a, q.p);
  const LargestCoordinate<R> along(ab, pb, ap);
  const auto area = [&](const Vec3<R>& v) { return along.pick(v.x, v.y, v.z); };
  const R n = area(ab), alpha_p = area(pb), beta_p = area(ap);
  const R alpha_r = area(cross(q.r, q.b)), beta_r = area(cross(q.a, q.r)), m = area(cross(q.p, q.r));

  const R u(32 * half_ulp<R>()), zero(0), to_edge = greater(size.p, size.r), to_face = greater(size.a, size.b);
  const R error = u * (size.a * size.b + to_edge * (size.a + size.b));
  // On the face a weight is between 0 and n.
  const R high = greater(zero, n) + error, low = lesser(zero, n) - error;
  const auto beyond = [&](R weight_p, R weight_r) {
    return lesser(weight_p, weight_r) > high || greater(weight_p, weight_r) < low;
  };
  // Twice the areas of the triangles of the edge and each corner.
  const R m_a = m + (beta_p - beta_r), m_b = m + (alpha_r - alpha_p);
  const R e_m = u * (size.p * size.r + to_edge * to_face);
  return size.usable && (beyond(alpha_p, alpha_r) || beyond(beta_p, beta_r) ||
                         beyond(n - (alpha_p + beta_p), n - (alpha_r + beta_r)) || lesser(lesser(m, m_a), m_b) > e_m ||
                         greater(greater(m, m_a), m_b) < zero - e_m);
}

}  // namespace hpccd
