// SPDX-License-Identifier: Apache-2.0
// The ways in which two features can be at distance d: a plane and a point or two lines, a line and a point, or two
// points. Each is a polynomial in t (the squared distance minus d^2, times its denominator) and further
// polynomials whose signs tell when it applies.
//
// Bits, for coordinates of b bits (query.h): n . n and the other conditions have at most 4 b + 13, sums of three of
// them 4 b + 15, f^2 has 6 b + 20.
#pragma once

#include "elementary/exact/query.h"
#include "elementary/exact/scaled.h"

namespace hpccd::exact {

template <class Distance, class Condition, int n>
struct Piece {
  Distance distance;                       // vanishes where they are d apart
  Condition not_zero;                      // never negative; zero where there is no plane or line
  std::array<Condition, n> at_least_zero;  // positive where the nearest points are inside
  int n_at_least_zero = n;
};

template <class Z>
class Pieces {
 public:
  static constexpr int room = 3;  // limbs between the scales of d^2 and of the squared coordinates
  static bool fits(const Margin& d) { return std::abs(2 * d.shift) <= 64 * room; }

  Pieces(const Query<Z>& q, const Margin& d) : q_(q), d_(d), d2_(Z(d.mantissa) * Z(d.mantissa)) {}

  // The cheapest pieces first: later ones are only searched before the times that these find.
  template <class Visit>
  void visit_all(Visit&& visit) const {
    for (int i = 0; i < q_.n_degenerate(); ++i) {
      const auto [from_start, from_end] = q_.degenerate(i);
      // Each pair of points occurs once.
      if (q_.kind == Kind::edge_edge ? i < 2 : i == 0) points(from_start, visit);
      if (i < 2) points(from_end, visit);
    }
    for (int i = 0; i < q_.n_degenerate(); ++i) point_and_line(i, visit);
    inside(visit);
  }

 private:
  // num - d^2 den
  template <class X, int D, class Y, int E>
  auto beyond(const Polynomial<X, D>& num, const Polynomial<Y, E>& den) const {
    const int up = std::max(0, -2 * d_.shift), down = std::max(0, 2 * d_.shift);
    using W = decltype(shifted<room>(num.c[0], up) - shifted<room>(den.c[0] * d2_, down));
    Polynomial<std::remove_const_t<W>, D> difference;
    for (int i = 0; i <= D; ++i) difference.c[i] = shifted<room>(num.c[i], up);
    for (int i = 0; i <= E; ++i) difference.c[i] = difference.c[i] - shifted<room>(den.c[i] * d2_, down);
    return difference;
  }

  template <class Visit>
  void inside(Visit& visit) const {
    Vector<typename Query<Z>::Quadratic> pb, ap;
    for (int k = 0; k < 3; ++k) pb[k] = q_.pb(k), ap[k] = q_.ap(k);
    const auto nn = dot(q_.n, q_.n), alpha = dot(pb, q_.n), beta = dot(ap, q_.n);
    const auto distance = beyond(q_.f * q_.f, nn);
    using P = Piece<std::remove_const_t<decltype(distance)>, std::remove_const_t<decltype(nn)>, 4>;
    if (q_.kind == Kind::vertex_face)
      visit(P{distance, nn, {alpha, beta, nn - alpha - beta, {}}, 3});
    else
      visit(P{distance, nn, {alpha, nn - alpha, -beta, nn + beta}});
  }

  template <class Visit>
  void point_and_line(int i, Visit& visit) const {
    const auto [from_start, from_end] = q_.degenerate(i);
    const auto line = from_start - from_end;
    const auto length = dot(line, line), along = dot(from_start, line);
    Vector<typename Query<Z>::Quadratic> beside;
    for (int k = 0; k < 3; ++k) beside[k] = q_.beside_line(i, k);
    const auto distance = beyond(dot(beside, beside), length);
    visit(Piece<std::remove_const_t<decltype(distance)>, std::remove_const_t<decltype(length)>, 2>{
        distance, length, {along, length - along}});
  }

  template <class Visit>
  void points(const Coordinates<Z>& between, Visit& visit) const {
    const Polynomial<Z, 0> one{{Z(1)}};
    const auto distance = beyond(dot(between, between), one);
    visit(Piece<std::remove_const_t<decltype(distance)>, Polynomial<Z, 0>, 0>{distance, one, {}});
  }

  const Query<Z>& q_;
  Margin d_;
  decltype(Z() * Z()) d2_;
};

}  // namespace hpccd::exact
