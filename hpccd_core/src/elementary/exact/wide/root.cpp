// SPDX-License-Identifier: Apache-2.0
#include "elementary/exact/wide/root.h"

namespace hpccd::exact::wide {
namespace {

int highest_bit(const Big& x) { return static_cast<int>(msb(x.sign() < 0 ? Big(-x) : x)); }

Big scaled(const Big& x, int bits) { return bits < 0 ? Big(x >> -bits) : Big(x << bits); }  // rounded down, x >= 0

int floor_of_ratio(int a, int b) { return a >= 0 ? a / b : -((b - 1 - a) / b); }

// An e such that p, as seen from a place where it is not zero, has no root up to a distance of 2^e: there no other term
// reaches a power of one half of the constant one, each term a smaller power.
int distance_without_root(const std::array<Big, 4>& p, int degree) {
  int e = std::numeric_limits<int>::max();
  for (int i = 1; i <= degree; ++i)
    if (!p[i].is_zero()) e = std::min(e, floor_of_ratio(highest_bit(p[0]) - highest_bit(p[i]) - 1, i) - 1);
  return e;
}

// The sign of p(+-2^e).
int sign_at_distance(const std::array<Big, 4>& p, int degree, bool upwards, int e) {
  Big sum = 0;
  for (int i = 0; i <= degree; ++i) {
    const Big term = p[i] << (e < 0 ? (i - degree) * e : i * e);
    sum = upwards || i % 2 == 0 ? Big(sum + term) : Big(sum - term);
  }
  return sign(sum);
}

}  // namespace

Root::Root(Big m, int k) : k_(k) { become_exact(std::move(m), k); }

Root::Root(Coefficients p, Big low, Big high, int k, int before)
    : of_(p.begin(), p.end()), low_(std::move(low)), high_(std::move(high)), k_(k), before_(before) {}

void Root::become_exact(Big m, int k) {
  if (!m.is_zero()) {
    const int zeros = std::min(k, static_cast<int>(lsb(m)));
    m >>= zeros;
    k -= zeros;
  }
  high_ = low_ = std::move(m);
  k_ = k;
  exact_ = true;
}

void Root::set_factor(std::vector<Big> factor) {
  of_ = std::move(factor);
  before_ = sign_there(low_, k_);
  at_low_ = at_high_ = 0;
}

void Root::narrow() {
  ++steps_;
  if (of_.size() == 2)
    divide();
  else if (!approached_)
    approach();
  else
    jump();
}

void Root::divide() {
  k_ = std::max(time_bits + 2, 2 * k_);
  const bool turned = sign(of_[1]) < 0;
  const Big den = turned ? Big(-of_[1]) : of_[1];
  Big rest;
  divide_qr(Big((turned ? of_[0] : Big(-of_[0])) << k_), den, low_, rest);
  if (rest.is_zero())
    become_exact(Big(low_), k_);
  else
    high_ = low_ + 1;
}

// Brings the root into an interval of 9 to 32 cells of a grid that is no finer than its distance from the ends calls
// for. All other roots, complex ones too, are at least about as far from it as the nearer end was: p turns or inflects
// there. So jumps gain ground from here on.
void Root::approach() {
  approached_ = true;
  constexpr int cell_bits = 4;
  int excess = highest_bit(Big(high_ - low_)) - cell_bits;
  if (excess < 0) {
    low_ <<= -excess;
    high_ <<= -excess;
    k_ -= excess;
    excess = 0;
  }
  const int k = k_ - excess;
  Big first = (low_ >> excess) + 1, last = high_ >> excess;
  const int at_first = sign_there(first, k);
  if (at_first == 0) return become_exact(std::move(first), k);
  if (at_first != before_) return approach_from(low_, true, excess);
  const int at_last = sign_there(last, k);
  if (at_last == 0) return become_exact(std::move(last), k);
  if (at_last == before_) return approach_from(high_, false, excess);
  low_ = std::move(first), high_ = std::move(last), k_ = k;
}

// The root is nearer than 2^limit to the base, one end of the interval.
void Root::approach_from(const Big& base, bool upwards, int limit) {
  const int degree = degree_of(of_);
  const auto local = seen_from(of_, base, k_);
  const int at_base = upwards ? before_ : -before_;
  int below = distance_without_root(local, degree), above = limit;
  for (int step = 1; below + step < above; step *= 2) {
    const int s = sign_at_distance(local, degree, upwards, below + step);
    if (s != at_base) above = below + step;
    if (s == at_base) below += step;
  }
  while (above - below > 1) {
    const int middle = below + (above - below) / 2;
    const int s = sign_at_distance(local, degree, upwards, middle);
    (s == at_base ? below : above) = middle;
  }
  // The distance is in (8, 16] cells of a grid in which the base lies in [cell, cell + 1).
  const int excess = below - 3;
  const Big cell = scaled(base, -excess);
  low_ = upwards ? cell + 8 : cell - 17;
  high_ = upwards ? cell + 17 : cell - 7;
  k_ -= excess;
}

// Quadratic interval refinement (Abbott 2006): the secant says near the end of which of 2^bits cells the root is, and
// exact signs there and at the next end whether it is so.
void Root::jump() {
  const int degree = degree_of(of_);
  if (at_low_.is_zero()) at_low_ = value(of_, low_, k_), at_high_ = value(of_, high_, k_);
  const int k = k_ + bits_;
  const auto move = [&](Big low, Big at_low, Big high, Big at_high) {
    low_ = std::move(low), at_low_ = std::move(at_low), high_ = std::move(high), at_high_ = std::move(at_high);
    k_ = k;
    bits_ *= 2;
  };
  if (bits_ == 1) {
    Big middle = low_ + high_, v = value(of_, middle, k);
    if (v.is_zero()) return become_exact(std::move(middle), k);
    if (sign(v) == before_)
      move(std::move(middle), std::move(v), high_ << 1, at_high_ << degree);
    else
      move(low_ << 1, at_low_ << degree, std::move(middle), std::move(v));
    return;
  }
  const Big cells = (high_ - low_) << bits_;
  Big fall = abs(at_low_), whole = fall + abs(at_high_);
  const int excess = highest_bit(whole) - highest_bit(cells) - 8;  // bits that the guess does not need
  if (excess > 0) fall >>= excess, whole >>= excess;
  // To the nearest end of a cell, whose two cells are both tried.
  const Big nearest = (2 * cells * fall + whole) / (2 * whole);
  Big m = (low_ << bits_) + std::clamp(nearest, Big(1), Big(cells - 1));
  Big v = value(of_, m, k);
  if (v.is_zero()) return become_exact(std::move(m), k);
  const bool below = sign(v) == before_;
  Big other = below ? m + 1 : m - 1, at_other = value(of_, other, k);
  if (at_other.is_zero()) return become_exact(std::move(other), k);
  if ((sign(at_other) == before_) == below)
    bits_ /= 2;
  else if (below)
    move(std::move(m), std::move(v), std::move(other), std::move(at_other));
  else
    move(std::move(other), std::move(at_other), std::move(m), std::move(v));
}

std::int64_t Root::time() {
  for (;;) {
    if (exact_) return static_cast<std::int64_t>(scaled(low_, time_bits - k_));
    if (const int excess = k_ - time_bits; excess >= 0) {
      const Big first = low_ >> excess;
      Big last = (high_ - 1) >> excess;
      if (first == last) return static_cast<std::int64_t>(first);
      if (last - first == 1) {
        const int s = sign_there(last, time_bits);
        if (s == 0)
          become_exact(std::move(last), time_bits);
        else
          return static_cast<std::int64_t>(s == before_ ? last : first);
        continue;
      }
    }
    narrow();
  }
}

}  // namespace hpccd::exact::wide
