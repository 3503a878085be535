// SPDX-License-Identifier: Apache-2.0
#include "elementary/exact/separation.h"

#include "elementary/exact/distance.h"
#include "elementary/exact/earliest.h"
#include "elementary/exact/pieces.h"
#include "elementary/exact/rounded.h"
#include "elementary/exact/scaled.h"
#include "elementary/exact/wide/first_time.h"

namespace hpccd::exact {
namespace {

// Along each axis the swept boxes are farther apart than d; a difference of doubles, rounded, is above d only where
// the true one is.
bool boxes_apart(Kind kind, const Vec3<double> q_t0[4], const Vec3<double> q_t1[4], double d) {
  const int split = kind == Kind::vertex_face ? 1 : 2;
  for (int k = 0; k < 3; ++k) {
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    for (int i = 0; i < 4; ++i)
      for (const auto* q : {q_t0, q_t1}) {
        const double x = coordinate(q[i], k);
        low[i >= split] = std::min(low[i >= split], x);
        high[i >= split] = std::max(high[i >= split], x);
      }
    if (low[1] - high[0] > d || low[0] - high[1] > d) return true;
  }
  return false;
}

template <class Z, int D>
Polynomial<Big, D> to_big(const Polynomial<Z, D>& p) {
  Polynomial<Big, D> big;
  for (int i = 0; i <= D; ++i) big.c[i] = exact::to_big(p.c[i]);
  return big;
}

// In integers of any size.
template <int D, int E, int n>
struct WidePiece {
  Polynomial<Big, D> distance;
  Polynomial<Big, E> not_zero;
  std::array<Polynomial<Big, E>, n> at_least_zero;
  int n_at_least_zero;

  template <class P>
  explicit WidePiece(const P& piece)
      : distance(to_big(piece.distance)), not_zero(to_big(piece.not_zero)), n_at_least_zero(piece.n_at_least_zero) {
    for (int i = 0; i < n_at_least_zero; ++i) at_least_zero[i] = to_big(piece.at_least_zero[i]);
  }
  wide::Event event() const {
    wide::Event event{wide::coefficients(distance), wide::coefficients(not_zero), {}};
    for (int i = 0; i < n_at_least_zero; ++i) event.at_least_zero.push_back(wide::coefficients(at_least_zero[i]));
    return event;
  }
};

// The earliest time of all pieces.
class Earliest {
 public:
  template <class Distance, class Condition, int n>
  void operator()(const Piece<Distance, Condition, n>& piece) {
    if (piece.distance.degree() <= 0 || piece.not_zero.degree() < 0) return;
    consider(piece);
  }

  std::optional<double> time() const {
    if (first_ == never) return {};
    return rounded_down(first_);
  }

 private:
  static constexpr std::int64_t never = (std::int64_t{1} << time_bits) + 1;

  template <class Z, int D, class Y, int E, int n>
  void consider(const Piece<Polynomial<Z, D>, Polynomial<Y, E>, n>& piece) {
    RoundedEvent<D, E> event;
    round(piece.distance, event.f);
    if (E > 0) round(piece.not_zero, event.positive[event.n++]);
    for (int i = 0; i < piece.n_at_least_zero; ++i)
      if (round(piece.at_least_zero[i], event.positive[event.n])) ++event.n;
    std::optional<WidePiece<D, E, n>> wide;
    const auto found = [&](const Bracket<D>& bracket) { return time_of_root(piece.distance, bracket); };
    const auto undecided = [&](std::int64_t low, int halvings) {
      if (!wide) wide.emplace(piece);
      return wide::first_time(wide->event(), {low, halvings, halvings}, first_);
    };
    if (const auto time =
            EarlySearch<D, E, decltype(found), decltype(undecided)>(first_, found, undecided).first(event))
      first_ = std::min(first_, *time);
  }

  std::int64_t first_ = never;
};

template <class Z>
std::optional<double> earliest(Kind kind, const Given& begin, const Given& end, int low, const Margin& d) {
  Coordinates<Z> points[4];
  for (int i = 0; i < 4; ++i)
    for (int k = 0; k < 3; ++k) {
      const Z z0 = scaled_integer<Z>(begin.x[i][k], low), z1 = scaled_integer<Z>(end.x[i][k], low);
      points[i][k] = {{z0, z1 - z0}};
    }
  Earliest earliest;
  Pieces<Z>({kind, points}, d).visit_all(earliest);
  return earliest.time();
}

}  // namespace

std::optional<double> earliest_within(Kind kind, const Vec3<double> q_t0[4], const Vec3<double> q_t1[4], double d) {
  if (boxes_apart(kind, q_t0, q_t1, d)) return std::nullopt;
  if (within(kind, q_t0, d)) return 0.0;
  const Given begin(q_t0), end(q_t1);
  BitRange range = begin.range;
  range.include(end.range);
  const Margin margin(d, range.low);
  const bool small = Pieces<Big>::fits(margin);
  if (small && range.bits() <= Widths<Integer<1>>::coordinate_bits)
    return earliest<Integer<1>>(kind, begin, end, range.low, margin);
  if (small && range.bits() <= Widths<Integer<2>>::coordinate_bits)
    return earliest<Integer<2>>(kind, begin, end, range.low, margin);
  return earliest<Big>(kind, begin, end, range.low, margin);
}

}  // namespace hpccd::exact
