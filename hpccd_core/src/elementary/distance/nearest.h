// SPDX-License-Identifier: Apache-2.0
// Nearest points of two features at one moment. In p, a and b of motion.h the vector from a point of the face to the
// vertex, or from a point of edge a to one of edge b, is gap(x, y) = p - x a - y b; x and y range over the triangle
// x, y >= 0, x + y <= 1, or over the square 0 <= x <= 1, -1 <= y <= 0.
#pragma once

#include "elementary/inside.h"

namespace hpccd {

template <class R>
struct Snapshot {
  Vec3<R> p, a, b;
};

template <class R>
HPCCD_HD Snapshot<R> snapshot_at(const Motion<R>& m, R t) {
  return {interpolate(m.p0, m.p1, t), interpolate(m.a0, m.a1, t), interpolate(m.b0, m.b1, t)};
}

template <class R>
struct Nearest {
  R x, y;       // where the gap is smallest, as well as rounding allows: a place of the features, up to rounding
  Vec3<R> gap;  // there
  R square;     // |gap|^2
};

namespace detail {

template <class R>
struct Place {
  using Mask = typename RealTraits<R>::Mask;
  R x, y;
  Vec3<R> gap, along;  // the border that it is on; zero at a corner
  R square;
  Mask inside;  // on no border
};

template <class R>
HPCCD_HD Place<R> place(const Snapshot<R>& s, R x, R y, const Vec3<R>& along, typename RealTraits<R>::Mask inside) {
  const Vec3<R> gap = s.p - x * s.a - y * s.b;
  return {x, y, gap, along, dot(gap, gap), inside};
}

// The places of a border, from 0 to 1: at `best`, or at the end that is nearest to it. Written so that NaN gives 0.
template <class R>
struct OnBorder {
  R at;
  Vec3<R> along;
  HPCCD_HD OnBorder(R best, const Vec3<R>& border)
      : at(select(best > R(0), lesser(best, R(1)), R(0))),
        along(select(best > R(0) && best < R(1), R(1), R(0)) * border) {}
};

// Written so that NaN never wins.
template <class R>
HPCCD_HD void keep_nearer(Place<R>& best, const Place<R>& other, typename RealTraits<R>::Mask allowed) {
  const auto wins = allowed && other.square < best.square;
  const auto vector = [&](const Vec3<R>& x, const Vec3<R>& y) {
    return Vec3<R>{select(wins, x.x, y.x), select(wins, x.y, y.y), select(wins, x.z, y.z)};
  };
  best = {select(wins, other.x, best.x),
          select(wins, other.y, best.y),
          vector(other.gap, best.gap),
          vector(other.along, best.along),
          select(wins, other.square, best.square),
          (wins && other.inside) || (!wins && best.inside)};
}

// A short gap between long features is known to their rounding only, and its direction to that over its length. But it
// stands on what its place may move along, which is known well: what it has along that is all rounding.
template <class R>
HPCCD_HD Nearest<R> straightened(const Place<R>& best, const Snapshot<R>& s) {
  const Vec3<R> n = cross(s.a, s.b);
  const R along = dot(best.along, best.along);
  const R by_n = dot(best.gap, n) / dot(n, n), by_border = dot(best.gap, best.along) / along;
  const Vec3<R> on_plane = by_n * n, on_border = best.gap - select(along > R(0), by_border, R(0)) * best.along;
  const Vec3<R> gap{select(best.inside, on_plane.x, on_border.x), select(best.inside, on_plane.y, on_border.y),
                    select(best.inside, on_plane.z, on_border.z)};
  return {best.x, best.y, gap, dot(gap, gap)};
}

}  // namespace detail

// The smallest of the gaps at the free minimum and at the best places of the borders: of those that rounding spoils
// (parallel edges, needles) none is smallest.
template <Kind kind, class R>
HPCCD_HD Nearest<R> nearest(const Snapshot<R>& s) {
  using namespace detail;
  const R aa = dot(s.a, s.a), ab = dot(s.a, s.b), bb = dot(s.b, s.b), pa = dot(s.p, s.a), pb = dot(s.p, s.b);
  const R per_det = R(1) / (aa * bb - ab * ab), x = per_det * (pa * bb - pb * ab), y = per_det * (pb * aa - pa * ab);
  const R per_aa = R(1) / aa, per_bb = R(1) / bb;
  const auto yes = R(0) < R(1), no = R(1) < R(0);
  Place<R> best;
  if constexpr (kind == Kind::vertex_face) {
    const Vec3<R> c = s.b - s.a;
    const OnBorder<R> on_a(per_aa * pa, s.a), on_b(per_bb * pb, s.b), on_c(dot(s.p - s.a, c) / dot(c, c), c);
    best = place(s, on_a.at, R(0), on_a.along, no);
    keep_nearer(best, place(s, R(0), on_b.at, on_b.along, no), yes);
    keep_nearer(best, place(s, R(1) - on_c.at, on_c.at, on_c.along, no), yes);
    keep_nearer(best, place(s, x, y, c, yes), x >= R(0) && y >= R(0) && x + y <= R(1));
  } else {
    const OnBorder<R> start_of_b(per_aa * pa, s.a), end_of_b(per_aa * (pa + ab), s.a),
        start_of_a(R(0) - per_bb * pb, s.b), end_of_a(per_bb * (ab - pb), s.b);
    best = place(s, start_of_b.at, R(0), start_of_b.along, no);
    keep_nearer(best, place(s, end_of_b.at, R(-1), end_of_b.along, no), yes);
    keep_nearer(best, place(s, R(0), R(0) - start_of_a.at, start_of_a.along, no), yes);
    keep_nearer(best, place(s, R(1), R(0) - end_of_a.at, end_of_a.along, no), yes);
    keep_nearer(best, place(s, x, y, s.a, yes), x >= R(0) && x <= R(1) && y <= R(0) && y >= R(-1));
  }
  return straightened(best, s);
}

// Along a fixed direction the gap of two features is smallest between two of their corners.
template <Kind kind>
inline constexpr int n_corners = kind == Kind::vertex_face ? 3 : 4;

template <Kind kind, class R>
HPCCD_HD void corner_gaps(const Vec3<R>& u, const Snapshot<R>& s, R gaps[4]) {
  const R up = dot(u, s.p), ua = dot(u, s.a), ub = dot(u, s.b);
  gaps[0] = up;
  gaps[1] = up - ua;
  if constexpr (kind == Kind::vertex_face) {
    gaps[2] = up - ub;
  } else {
    gaps[2] = up + ub;
    gaps[3] = up - ua + ub;
  }
}

}  // namespace hpccd
