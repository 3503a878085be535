// SPDX-License-Identifier: Apache-2.0
#include "elementary/exact/separation.h"

#include "elementary/exact/distance.h"
#include "elementary/exact/earliest.h"
#include "elementary/exact/scaled.h"
#include "elementary/exact/wide/first_time.h"

namespace hpccd::exact {
namespace {

template <class Z, int D>
auto square(const Polynomial<Z, D>& p) {
  return p * p;
}

template <class Z, int D, class W>
Polynomial<Z, D> scaled(const Polynomial<Z, D>& p, const W& factor) {
  Polynomial<Z, D> s;
  for (int i = 0; i <= D; ++i) s.c[i] = p.c[i] * factor;
  return s;
}

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

// The squared distance of planes, or lines, points less d^2, times what makes it a polynomial.
class Meeting {
 public:
  Meeting(const Query<Big>& q, const Margin& d) : q_(q), d_(d), d2_(Big(d.mantissa) * d.mantissa) {}

  std::optional<double> earliest() {
    constexpr std::int64_t never = (std::int64_t{1} << time_bits) + 1;
    first_ = never;
    inside();
    for (int i = 0; i < q_.n_degenerate(); ++i) on_segment(i);
    if (first_ == never) return {};
    return rounded_down(first_);
  }

 private:
  template <int D, int E>
  Polynomial<Big, D> beyond(Polynomial<Big, D> num, const Polynomial<Big, E>& den) const {
    auto limit = scaled(den, d2_);
    if (d_.shift < 0)
      for (Big& c : num.c) c <<= -2 * d_.shift;
    if (d_.shift > 0)
      for (Big& c : limit.c) c <<= 2 * d_.shift;
    for (int i = 0; i <= E; ++i) num.c[i] -= limit.c[i];
    return num;
  }

  void consider(const wide::Event& event) { first_ = std::min(first_, wide::first_time(event, first_)); }

  void inside() {
    const auto nn = dot(q_.n, q_.n);
    Vector<Query<Big>::Quadratic> pb, ap;
    for (int k = 0; k < 3; ++k) pb[k] = q_.pb(k), ap[k] = q_.ap(k);
    const auto alpha = dot(pb, q_.n), beta = dot(ap, q_.n);
    const auto f = beyond(square(q_.f), nn);
    std::vector<Polynomial<Big, 4>> conditions;
    if (q_.kind == Kind::vertex_face)
      conditions = {alpha, beta, nn - alpha - beta};
    else
      conditions = {alpha, nn - alpha, -beta, nn + beta};
    wide::Event event{wide::coefficients(f), wide::coefficients(nn), {}};
    for (const auto& c : conditions) event.at_least_zero.push_back(wide::coefficients(c));
    consider(event);
  }

  void to_point(const Coordinates<Big>& between) {
    const Polynomial<Big, 0> one{{1}};
    const auto f = beyond(dot(between, between), one);
    consider({wide::coefficients(f), wide::coefficients(one), {}});
  }

  void on_segment(int i) {
    const auto [from_start, from_end] = q_.degenerate(i);
    const auto e = from_start - from_end;
    const auto length = dot(e, e);
    Vector<Query<Big>::Quadratic> beside;
    for (int k = 0; k < 3; ++k) beside[k] = q_.beside_line(i, k);
    const auto f = beyond(dot(beside, beside), length);
    const auto along = dot(from_start, e), rest = length - along;
    consider(
        {wide::coefficients(f), wide::coefficients(length), {wide::coefficients(along), wide::coefficients(rest)}});
    // Each pair of points once.
    if (q_.kind == Kind::edge_edge ? i < 2 : i == 0) to_point(from_start);
    if (i < 2) to_point(from_end);
  }

  const Query<Big>& q_;
  Margin d_;
  Big d2_;
  std::int64_t first_;
};

}  // namespace

std::optional<double> earliest_within(Kind kind, const Vec3<double> q_t0[4], const Vec3<double> q_t1[4], double d) {
  if (boxes_apart(kind, q_t0, q_t1, d)) return std::nullopt;
  if (within(kind, q_t0, d)) return 0.0;
  const Given begin(q_t0), end(q_t1);
  const int low = std::min(begin.range.low, end.range.low);
  Coordinates<Big> points[4];
  for (int i = 0; i < 4; ++i)
    for (int k = 0; k < 3; ++k) {
      const Big z0 = scaled_integer<Big>(begin.x[i][k], low), z1 = scaled_integer<Big>(end.x[i][k], low);
      points[i][k] = {{z0, z1 - z0}};
    }
  const Query<Big> query(kind, points);
  return Meeting(query, Margin(d, low)).earliest();
}

}  // namespace hpccd::exact
