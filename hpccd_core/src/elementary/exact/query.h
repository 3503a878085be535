// SPDX-License-Identifier: Apache-2.0
// The polynomials whose signs decide whether the features touch at a root of f = p . (a x b).
//
// Bits, for coordinates of b bits: a difference's coefficients have b + 1 and b + 2, a cross product's 2 b + 3, 2 b +
// 5 and 2 b + 5, sums of three of them at most 2 b + 7; f's at most 3 b + 10.
#pragma once

#include <optional>

#include "elementary/exact/polynomial.h"
#include "elementary/exact/vector.h"
#include "elementary/motion.h"

namespace hpccd::exact {

template <class Z>
using Coordinates = Vector<Polynomial<Z, 1>>;  // a moving vector: one polynomial per coordinate

// Each axis of the points may have its own scale, which does not affect the signs below.
template <class Z>
struct Query {
  using Square = decltype(Z() * Z());
  using Quadratic = Polynomial<Square, 2>;
  using Cubic = Polynomial<decltype(Z() * Square()), 3>;

  Kind kind;
  Coordinates<Z> p, a, b;  // as in motion.h
  std::array<Quadratic, 3> n;
  Cubic f;

  // Coordinates of p x b and a x p. Products of large numbers are computed once.
  HPCCD_HOST_DEVICE decltype(auto) pb(int k) const { return product<0>(p, b, k); }
  HPCCD_HOST_DEVICE decltype(auto) ap(int k) const { return product<3>(a, p, k); }

  HPCCD_HOST_DEVICE_CALL Query(Kind kind_, const Coordinates<Z> q[4]) : kind(kind_) {
    if (kind == Kind::vertex_face)
      set_spans<Kind::vertex_face>(q);
    else
      set_spans<Kind::edge_edge>(q);
    for (int k = 0; k < 3; ++k) n[k] = cross(a, b, k);
    f = dot(p, n);
  }

  // The features touch if all conditions of a coordinate k, times the sign of n_k, are at least 0: alpha n and so on.
  template <class Visit>
  HPCCD_HOST_DEVICE void conditions(int k, Visit&& visit) const {
    const Quadratic &pb_k = pb(k), &ap_k = ap(k);
    if (kind == Kind::vertex_face)
      (void)(visit(pb_k) && visit(ap_k) && visit(n[k] - pb_k - ap_k));
    else
      (void)(visit(pb_k) && visit(n[k] - pb_k) && visit(-ap_k) && visit(n[k] + ap_k));
  }

  // If n vanishes, the triangle is the union of its edges, and two segments are parallel or points: they touch if a
  // point lies on a segment. The vectors from a segment's ends to the point.
  struct PointOnSegment {
    Coordinates<Z> from_start, from_end;
  };
  HPCCD_HOST_DEVICE int n_degenerate() const { return kind == Kind::vertex_face ? 3 : 4; }
  HPCCD_HOST_DEVICE_CALL PointOnSegment degenerate(int i) const {
    if (kind == Kind::vertex_face) {
      if (i == 0) return {p, p - b};
      if (i == 1) return {p, p - a};
      return {p - a, p - b};
    }
    if (i == 0) return {p, p + b};          // a0 on b, both vectors reversed
    if (i == 1) return {a - p, a - p - b};  // a1 on b
    return i == 2 ? PointOnSegment{p, p - a} : PointOnSegment{p + b, p + b - a};
  }
  // Coordinate k of their cross product, up to its sign: condition i.
  HPCCD_HOST_DEVICE_CALL Quadratic beside_line(int i, int k) const {
    if (kind == Kind::vertex_face) return i == 0 ? pb(k) : i == 1 ? ap(k) : n[k] - pb(k) - ap(k);
    return i == 0 ? pb(k) : i == 1 ? n[k] - pb(k) : i == 2 ? ap(k) : n[k] + ap(k);
  }

 private:
  template <Kind k>
  HPCCD_HOST_DEVICE void set_spans(const Coordinates<Z> q[4]) {
    using S = Spans<k>;
    p = q[S::p_to] - q[S::p_from], a = q[S::a_to] - q[S::a_from], b = q[S::b_to] - q[S::b_from];
  }

  static constexpr bool remembers = Widths<Z>::any_size;
  struct Nothing {};
  mutable std::conditional_t<remembers, std::array<std::optional<Quadratic>, 6>, Nothing> products_;

  template <int first>
  HPCCD_HOST_DEVICE decltype(auto) product(const Coordinates<Z>& x, const Coordinates<Z>& y, int k) const {
    if constexpr (remembers) {
      auto& known = products_[first + k];
      if (!known) known = cross(x, y, k);
      return static_cast<const Quadratic&>(*known);
    } else {
      return cross(x, y, k);
    }
  }
};

// sign_of(q) returns the sign of a polynomial at the given time.
template <class Z, class Sign>
HPCCD_HOST_DEVICE bool touches(const Query<Z>& q, Sign&& sign_of) {
  for (int k = 0; k < 3; ++k) {
    const int s = sign_of(q.n[k]);
    if (s == 0) continue;
    bool inside = true;
    q.conditions(k, [&](const auto& c) { return inside = sign_of(c) * s >= 0; });
    return inside;
  }
  for (int i = 0; i < q.n_degenerate(); ++i) {
    bool on_line = true;
    for (int k = 0; k < 3 && on_line; ++k) on_line = sign_of(q.beside_line(i, k)) == 0;
    // Between the ends, ends included; for a segment that is a point: at that point.
    if (!on_line) continue;
    const auto d = q.degenerate(i);
    if (sign_of(dot(d.from_start, d.from_end)) <= 0) return true;
  }
  return false;
}

// Motion that is coplanar throughout: the earliest time at which the features touch is 0 or a root of one of these
// polynomials. If a coordinate of n does not vanish throughout, its conditions decide between its roots, and the set of
// times at which they touch is closed. If n vanishes throughout, each point is on its line at roots of one polynomial
// only, or always.
template <class Z, class Visit>
HPCCD_HOST_DEVICE void for_event_polynomials(const Query<Z>& q, Visit&& visit) {
  for (int k = 0; k < 3; ++k) {
    if (q.n[k].degree() < 0) continue;
    visit(q.n[k]);
    q.conditions(k, [&](const auto& c) { return visit(c), true; });
    return;
  }
  for (int i = 0; i < q.n_degenerate(); ++i) {
    int k = 0;
    while (k < 3 && q.beside_line(i, k).degree() < 0) ++k;
    if (k < 3) {
      visit(q.beside_line(i, k));
    } else {
      const auto d = q.degenerate(i);
      visit(dot(d.from_start, d.from_end));
    }
  }
}

}  // namespace hpccd::exact
