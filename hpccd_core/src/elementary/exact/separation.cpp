// SPDX-License-Identifier: Apache-2.0
#include "elementary/exact/separation.h"

#include "elementary/exact/boxes.h"
#include "elementary/exact/distance.h"
#include "elementary/exact/earliest.h"
#include "elementary/exact/pieces.h"
#include "elementary/exact/rounded.h"
#include "elementary/exact/scaled.h"
#include "elementary/exact/wide/first_time.h"

namespace hpccd::exact {
namespace {

template <class Z, int D>
Polynomial<Big, D> to_big(const Polynomial<Z, D>& p) {
  Polynomial<Big, D> big;
  for (int i = 0; i <= D; ++i) big.c[i] = exact::to_big(p.c[i]);
  return big;
}

// The first time at which a piece applies, in integers.
template <class Distance, class Condition, int n>
class InIntegers;
template <class Z, int D, class Y, int E, int n>
class InIntegers<Polynomial<Z, D>, Polynomial<Y, E>, n> {
 public:
  using P = Piece<Polynomial<Z, D>, Polynomial<Y, E>, n>;
  InIntegers(const P& piece, std::int64_t limit) : piece_(piece), limit_(limit) {}

  std::optional<std::int64_t> in_bracket(const Bracket<D>& bracket) { return time_of_root(piece_.distance, bracket); }
  std::optional<std::int64_t> in_interval(std::int64_t low, int halvings) {
    return first_time({low, halvings, halvings}, 0);
  }
  std::optional<std::int64_t> after(std::int64_t from) { return first_time({}, from); }

 private:
  std::optional<std::int64_t> first_time(const wide::Window& window, std::int64_t from) {
    if (!first_time_) {
      wide::Event event{wide::coefficients(distance_ = to_big(piece_.distance)),
                        wide::coefficients(not_zero_ = to_big(piece_.not_zero)),
                        {}};
      for (int i = 0; i < piece_.n_at_least_zero; ++i)
        event.at_least_zero.push_back(wide::coefficients(at_least_zero_[i] = to_big(piece_.at_least_zero[i])));
      first_time_.emplace(event);
    }
    return first_time_->in(window, from, limit_);
  }

  const P& piece_;
  std::int64_t limit_;
  std::optional<wide::FirstTime> first_time_;
  Polynomial<Big, D> distance_;
  Polynomial<Big, E> not_zero_;
  std::array<Polynomial<Big, E>, n> at_least_zero_;
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
    InIntegers<Polynomial<Z, D>, Polynomial<Y, E>, n> integers(piece, first_);
    EarlySearch<D, E, decltype(integers)> search(first_, integers);
    if (const auto time = search.first(event)) first_ = std::min(first_, *time);
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
