// SPDX-License-Identifier: Apache-2.0
// The first root of a polynomial at which other polynomials are positive, in double precision where that suffices.
// Bernstein coefficients are computed in integers and then rounded; all errors after that are bounded.
#pragma once

#include <limits>
#include <optional>

#include "elementary/exact/polynomial.h"
#include "elementary/exact/root.h"

namespace hpccd::exact {

// Represented by its Bernstein coefficients, the largest of which is between 1/2 and 1.
template <int D>
struct Rounded {
  std::array<double, D + 1> b;
  int exponent;  // exponent of the power of two by which it was divided

  // A coefficient initially has three rounding errors; each halving adds D means with one rounding error each.
  static double error(int halvings) { return (3 + D * halvings) * 0x1p-53; }

  // 0: not certain.
  static int sign_of(double x, int halvings) { return x > error(halvings) ? 1 : x < -error(halvings) ? -1 : 0; }
  int sign_inside(int halvings) const {
    const int s = sign_of(b[0], halvings);
    for (int i = 1; i <= D; ++i)
      if (sign_of(b[i], halvings) != s) return 0;
    return s;
  }
  // For any values of the uncertain signs there is one change of sign, so one simple root.
  bool certainly_one_root(int halvings) const {
    const int first = sign_of(b[0], halvings);
    if (first * sign_of(b[D], halvings) >= 0) return false;
    int i = 1;
    while (sign_of(b[i], halvings) == first) ++i;
    if (sign_of(b[i], halvings) == 0) ++i;
    while (i < D && sign_of(b[i], halvings) == -first) ++i;
    return i >= D;
  }
  bool all_uncertain(int halvings) const {
    for (const double x : b)
      if (sign_of(x, halvings)) return false;
    return true;
  }
  void halve(Rounded& left, Rounded& right) const {
    right = *this;
    left.exponent = exponent;
    for (int i = 0; i <= D; ++i) {
      left.b[i] = right.b[0];
      for (int j = 0; j < D - i; ++j) right.b[j] = 0.5 * (right.b[j] + right.b[j + 1]);
    }
  }
  // The value at s in [0, 1], and the derivative.
  double at(double s, double& derivative) const {
    auto x = b;
    for (int i = D; i > 1; --i)
      for (int j = 0; j < i; ++j) x[j] += s * (x[j + 1] - x[j]);
    derivative = D * (x[1] - x[0]);
    return x[0] + s * (x[1] - x[0]);
  }
};

// False for the zero polynomial.
template <class Z, int D>
bool round(const Polynomial<Z, D>& p, Rounded<D>& rounded) {
  using W = Plus<Z, 1>;
  std::array<W, D + 1> b;
  for (int i = 0; i <= D; ++i) b[i] = W(p.c[i]);
  to_bernstein(b.data(), D);
  int e[D + 1];
  rounded.exponent = std::numeric_limits<int>::min();
  double binomial = 1;
  for (int i = 0; i <= D; ++i) {
    const int s = sign(b[i]);
    rounded.b[i] = s ? s * magnitude_of(b[i], e[i]) / binomial : 0;
    if (s) rounded.exponent = std::max(rounded.exponent, e[i]);
    binomial = binomial * (D - i) / (i + 1);
  }
  double most = 0;
  for (int i = 0; i <= D; ++i) {
    if (rounded.b[i] != 0) rounded.b[i] = std::ldexp(rounded.b[i], std::max(e[i] - rounded.exponent, -1000));
    most = std::max(most, std::fabs(rounded.b[i]));
  }
  if (most == 0) return false;
  int scale;
  std::frexp(most, &scale);
  rounded.exponent += scale;
  for (double& x : rounded.b) x = std::ldexp(x, -scale);
  return true;
}

// D: degree of the polynomial with the root, E: of those that must be positive.
template <int D, int E>
struct RoundedEvent {
  static constexpr int most_conditions = 5;
  Rounded<D> f;
  Rounded<E> positive[most_conditions];
  int n = 0;
};

// A root that is certainly the only one in [low, low + 1] / 2^halvings, and the polynomial there.
template <int D>
struct Bracket {
  std::int64_t low;
  int halvings;
  Rounded<D> f;
};

// The first root below limit / 2^62, as a time. `others` decides where doubles cannot: others.in_bracket(bracket)
// always, others.in_interval(low, halvings), including its later end, and others.after(from / 2^62), if there is one.
template <int D, int E, class Others>
class EarlySearch {
 public:
  EarlySearch(std::int64_t limit, Others& others) : limit_(limit), others_(others) {}

  std::optional<std::int64_t> first(const RoundedEvent<D, E>& event, std::int64_t low = 0, int halvings = 0) {
    const int bits = time_bits - halvings;
    if (low << bits >= limit_ || (low + 1) << bits <= known_ || event.f.sign_inside(halvings)) return {};
    RoundedEvent<D, E> left, right;
    for (int i = 0; i < event.n; ++i) {
      const int s = event.positive[i].sign_inside(halvings);
      if (s < 0) return {};
      if (s == 0) event.positive[i].halve(left.positive[left.n++], right.positive[right.n++]);
    }
    if (left.n == 0 && event.f.certainly_one_root(halvings))
      return others_.in_bracket(Bracket<D>{low, halvings, event.f});
    if (halvings == most_halvings || ++steps_ > most_steps || event.f.all_uncertain(halvings))
      return ask(low, halvings);
    event.f.halve(left.f, right.f);
    if (const auto time = first(left, 2 * low, halvings + 1)) return time;
    return first(right, 2 * low + 1, halvings + 1);
  }

 private:
  static constexpr int most_halvings = 45, most_steps = 200, most_questions = 2;

  // For a slightly larger interval: signs that are uncertain here are uncertain next to it as well.
  std::optional<std::int64_t> ask(std::int64_t low, int halvings) {
    if (++n_questions_ > most_questions) {
      limit_ = 0;
      return others_.after(low << (time_bits - halvings));
    }
    const int larger = std::min(3, halvings);
    known_ = ((low >> larger) + 1) << (time_bits - halvings + larger);
    return others_.in_interval(low >> larger, halvings - larger);
  }

  std::int64_t limit_;
  Others& others_;
  std::int64_t known_ = 0;  // there is none before
  int steps_ = 0, n_questions_ = 0;
};

// floor(root 2^62)
template <class Z, int D>
std::int64_t time_of_root(const Polynomial<Z, D>& p, const Bracket<D>& found) {
  const int bits = time_bits - found.halvings;
  const double cells = std::ldexp(1.0, bits);
  std::int64_t low = found.low << bits, high = (found.low + 1) << bits;
  const std::int64_t begin = low;
  double inside_low = 0, inside_high = 1, s = 0.5, derivative;
  for (int i = 0; i < 60; ++i) {
    const double value = found.f.at(s, derivative);
    ((value < 0) == (found.f.b[0] < 0) ? inside_low : inside_high) = s;
    double next = s - value / derivative;
    if (!(next > inside_low && next < inside_high)) next = inside_low + 0.5 * (inside_high - inside_low);
    if (std::fabs(next - s) < 0x1p-50) break;
    s = next;
  }
  const auto value = [&](std::int64_t x) { return value_at(p, Time<Z>(x), time_bits); };
  const auto newton = [&](const auto& v, std::int64_t x) {
    int e;
    const double size = magnitude_of(v, e);
    found.f.at(static_cast<double>(x - begin) / cells, derivative);
    return std::ldexp(size, e - found.f.exponent - D * time_bits) / derivative * cells;
  };
  close_in(low, high, found.f.b[0] < 0 ? -1 : 1, begin + static_cast<std::int64_t>(s * cells), value, newton);
  return low;
}

}  // namespace hpccd::exact
