// SPDX-License-Identifier: Apache-2.0
// Nearest points of two features at one time. In terms of p, a and b of motion.h, the vector from a point of the face
// to the vertex, or from a point of edge a to one of edge b, is gap(x, y) = p - x a - y b. (x, y) ranges over the
// triangle x, y >= 0, x + y <= 1, or over the square 0 <= x <= 1, -1 <= y <= 0.
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
  R x, y;    // where the gap is smallest, up to rounding: a point of the features
  R square;  // the gap there: not shorter than the distance of the features
  // The gap with a corrected direction: for needles and parallel edges it may be far too short.
  Vec3<R> straight;
  R straight_square;
};

namespace detail {

// A point of the features and the directions in which it may move: the border over_a a + over_b b, none at a corner, or
// both a and b inside.
template <class R>
struct Place {
  R x, y, over_a, over_b;
  typename RealTraits<R>::Mask inside;
  R square;  // |gap|^2 there
};

template <class R>
HPCCD_HD Vec3<R> gap_at(const Snapshot<R>& s, R x, R y) {
  return s.p - x * s.a - y * s.b;
}

template <class R>
HPCCD_HD R square_at(const Snapshot<R>& s, R x, R y) {
  const Vec3<R> gap = gap_at(s, x, y);
  return dot(gap, gap);
}

// A position on a border, from 0 to 1: the best one, or the end nearest to it. Written so that NaN gives 0.
template <class R>
struct OnBorder {
  R at, moves;
  HPCCD_HD explicit OnBorder(R best)
      : at(select(best > R(0), lesser(best, R(1)), R(0))), moves(select(best > R(0) && best < R(1), R(1), R(0))) {}
};

// Written so that NaN never wins.
template <class R>
HPCCD_HD void keep_nearer(Place<R>& best, const Place<R>& other, typename RealTraits<R>::Mask allowed) {
  const auto wins = allowed && other.square < best.square;
  best = {select(wins, other.x, best.x),
          select(wins, other.y, best.y),
          select(wins, other.over_a, best.over_a),
          select(wins, other.over_b, best.over_b),
          (wins && other.inside) || (!wins && best.inside),
          select(wins, other.square, best.square)};
}

// The better of the free minimum and the best points of the borders. Points that rounding has spoiled (parallel edges,
// needles) are never the best.
template <Kind kind, class R>
HPCCD_HD Place<R> best_place(const Snapshot<R>& s) {
  const R aa = dot(s.a, s.a), ab = dot(s.a, s.b), bb = dot(s.b, s.b), pa = dot(s.p, s.a), pb = dot(s.p, s.b);
  const R per_det = R(1) / (aa * bb - ab * ab), x = per_det * (pa * bb - pb * ab), y = per_det * (pb * aa - pa * ab);
  const R per_aa = R(1) / aa, per_bb = R(1) / bb;
  const auto yes = R(0) < R(1), no = R(1) < R(0);
  const auto place = [&](R at_x, R at_y, R over_a, R over_b) {
    return Place<R>{at_x, at_y, over_a, over_b, no, square_at(s, at_x, at_y)};
  };
  const Place<R> free{x, y, R(0), R(0), yes, square_at(s, x, y)};
  if constexpr (kind == Kind::vertex_face) {
    const Vec3<R> c = s.b - s.a;
    const OnBorder<R> on_a(per_aa * pa), on_b(per_bb * pb), on_c(dot(s.p - s.a, c) / dot(c, c));
    Place<R> best = place(on_a.at, R(0), on_a.moves, R(0));
    keep_nearer(best, place(R(0), on_b.at, R(0), on_b.moves), yes);
    keep_nearer(best, place(R(1) - on_c.at, on_c.at, R(0) - on_c.moves, on_c.moves), yes);
    keep_nearer(best, free, x >= R(0) && y >= R(0) && x + y <= R(1));
    return best;
  } else {
    const OnBorder<R> start_of_b(per_aa * pa), end_of_b(per_aa * (pa + ab)), start_of_a(R(0) - per_bb * pb),
        end_of_a(per_bb * (ab - pb));
    Place<R> best = place(start_of_b.at, R(0), start_of_b.moves, R(0));
    keep_nearer(best, place(end_of_b.at, R(-1), end_of_b.moves, R(0)), yes);
    keep_nearer(best, place(R(0), R(0) - start_of_a.at, R(0), start_of_a.moves), yes);
    keep_nearer(best, place(R(1), R(0) - end_of_a.at, R(0), end_of_a.moves), yes);
    keep_nearer(best, free, x >= R(0) && x <= R(1) && y <= R(0) && y >= R(-1));
    return best;
  }
}

// A short gap between long features is known to their rounding errors only, and its direction to these divided by its
// length. But the gap is perpendicular to the directions in which its point may move, which are accurate: its component
// along them is rounding error.
template <class R>
HPCCD_HD Nearest<R> straightened(const Place<R>& best, const Snapshot<R>& s) {
  const Vec3<R> given = gap_at(s, best.x, best.y), n = cross(s.a, s.b);
  const Vec3<R> along = best.over_a * s.a + best.over_b * s.b;
  const R square = dot(along, along), by_n = dot(given, n) / dot(n, n);
  const Vec3<R> on_plane = by_n * n,
                on_border = given - select(square > R(0), dot(given, along) / square, R(0)) * along;
  const Vec3<R> gap{select(best.inside, on_plane.x, on_border.x), select(best.inside, on_plane.y, on_border.y),
                    select(best.inside, on_plane.z, on_border.z)};
  return {best.x, best.y, best.square, gap, dot(gap, gap)};
}

}  // namespace detail

template <Kind kind, class R>
HPCCD_HD Nearest<R> nearest(const Snapshot<R>& s) {
  return detail::straightened(detail::best_place<kind>(s), s);
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
