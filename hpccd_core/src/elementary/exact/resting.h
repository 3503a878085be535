// SPDX-License-Identifier: Apache-2.0
// The features of one query at rest, in integers of one type: their nearest parts and the distance.
//
// Bits, for coordinates of b bits: a difference has b + 1, a scalar product 2 b + 4, a coordinate of a vector product
// 2 b + 3; products of two such vectors 4 b + 8; f 3 b + 6; f^2 and its like at most twice as many.
#pragma once

#include "elementary/exact/integers.h"
#include "elementary/exact/vector.h"
#include "elementary/motion.h"

namespace hpccd::exact {

// A point and a segment, by vertex numbers (v f0 f1 f2 or a0 a1 b0 b1).
struct PointAndSegment {
  int point, from, to;
};
// On the boundaries of the features.
inline constexpr PointAndSegment point_segments[2][4] = {{{0, 1, 2}, {0, 1, 3}, {0, 2, 3}},
                                                         {{0, 2, 3}, {1, 2, 3}, {2, 0, 1}, {3, 0, 1}}};
inline int n_point_segments(Kind kind) { return kind == Kind::vertex_face ? 3 : 4; }

template <class Z>
struct Resting {
  Kind kind;
  Vector<Z> q[4];

  struct Spanned {
    Vector<Z> p, a, b;  // as in motion.h
  };
  Spanned spanned() const {
    if (kind == Kind::vertex_face) return {q[0] - q[1], q[2] - q[1], q[3] - q[1]};
    return {q[2] - q[0], q[1] - q[0], q[3] - q[2]};
  }

  // Calls visit for all that may be nearest, until it returns false; i numbers the points and segments above. The
  // squared distance is the ratio of the first two arguments.
  //   visit.planes(f^2, n . n, alpha n . n, beta n . n)
  //     both inside, at p = alpha a + beta b + f n / n . n; nothing else then
  //   visit.line(num, length^2, along length^2, i)
  //     the point's foot lies between the ends
  //   visit.points(num, i, end)
  //     nearest to the start (0) or the end (1) of the segment
  template <class Visit>
  void for_nearest(Visit&& visit) const {
    const auto [p, a, b] = spanned();
    const auto n = cross(a, b);
    if (const auto nn = dot(n, n); sign(nn) != 0) {
      const auto alpha = dot(cross(p, b), n), beta = dot(cross(a, p), n);
      if (inside(nn, alpha, beta)) {
        const auto f = dot(p, n);
        return (void)visit.planes(f * f, nn, alpha, beta);
      }
    }
    for (int i = 0; i < n_point_segments(kind); ++i)
      if (!to_segment(i, visit)) return;
  }

 private:
  template <class W>
  bool inside(const W& nn, const W& alpha, const W& beta) const {
    if (sign(alpha) < 0) return false;
    if (kind == Kind::vertex_face) return sign(beta) >= 0 && sign(nn - alpha - beta) >= 0;
    return sign(nn - alpha) >= 0 && sign(beta) <= 0 && sign(nn + beta) >= 0;
  }

  template <class Visit>
  bool to_segment(int i, Visit& visit) const {
    const auto [point, from, to] = point_segments[kind == Kind::edge_edge][i];
    const Vector<Z> w = q[point] - q[from], e = q[to] - q[from];
    const auto along = dot(w, e);
    if (sign(along) <= 0) return visit.points(dot(w, w), i, 0);
    const auto length = dot(e, e);
    if (sign(length - along) <= 0) {
      const Vector<Z> from_end = q[point] - q[to];
      return visit.points(dot(from_end, from_end), i, 1);
    }
    const auto beside = cross(w, e);
    return visit.line(dot(beside, beside), length, along, i);
  }
};

}  // namespace hpccd::exact
