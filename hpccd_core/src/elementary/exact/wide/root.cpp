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
}

void Root::narrow() {
  if (of_.size() == 2)
    divide();
  else if (rough_k_ < 0)
    approach();
  else
    step();
}

int Root::known_bits() const { return of_.size() == 2 ? k_ : rough_k_ < 0 ? 0 : k_ - rough_k_; }

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

// Brings the root into an interval of 9 to 28 cells of a grid that is no finer than its distance from the ends calls
// for. All other roots, complex ones too, are at least about as far from it as the nearer end was: p turns or inflects
// there. So steps gain ground from here on.
void Root::approach() {
  constexpr int cell_bits = 4;
  int excess = highest_bit(Big(high_ - low_)) - cell_bits;
  if (excess < 0) {
    low_ <<= -excess;
    high_ <<= -excess;
    k_ -= excess;
    excess = 0;
  }
  const int k = k_ - excess;
  Big first = (low_ >> excess) + 2, last = ((high_ - 1) >> excess) - 1;
  const int at_first = sign_there(first, k);
  if (at_first == 0) return become_exact(std::move(first), k);
  if (at_first != before_) return approach_from(low_, true, excess + 1);
  const int at_last = sign_there(last, k);
  if (at_last == 0) return become_exact(std::move(last), k);
  if (at_last == before_) return approach_from(high_, false, excess + 1);
  low_ = std::move(first), high_ = std::move(last), rough_k_ = k_ = k;
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
  rough_k_ = k_ -= excess;
}

// Newton's method on the whole interval: with p = a0 + a1 s + a2 s^2 + a3 s^3 seen from its middle, the root is at
// s = -a0 / (a1 + d), and |d| <= |a2| w + |a3| w^2 for all |s| <= w. One value per doubling of the bits, at half the
// bits that it yields. Halves the interval where that gains more.
void Root::step() {
  const int degree = degree_of(of_), k = k_ + 1;
  const Big middle = low_ + high_, w = high_ - low_;
  const auto a = seen_from(of_, middle, k);
  if (a[0].is_zero()) return become_exact(middle, k);
  Big d = degree == 3 ? Big((abs(a[3]) * w + abs(a[2])) * w) : Big(abs(a[2]) * w), least = abs(a[1]) - d;
  if (sign(least) > 0) {
    // The error of -a0 / a1 is below 2^e. Bits that cost more than all before are not taken, though they come free.
    const int most = 16 + k_ - rough_k_;
    const int e = highest_bit(a[0]) + highest_bit(d) + 2 - highest_bit(a[1]) - highest_bit(least);
    const int more = std::clamp(-e, 0, most);
    Big num = -a[0] << more, den = a[1];
    // As many bits of both as an error below one asks for.
    const int quotient_bits = highest_bit(a[0]) - highest_bit(a[1]) + 1 + more;
    const int excess = highest_bit(a[1]) - std::max(quotient_bits, 0) - 4;
    if (excess > 0) num >>= excess, den >>= excess;
    const Big center = (middle << more) + num / den, margin = (Big(1) << std::max(0, e)) + 2;
    Big low = std::max(Big(center - margin), Big(low_ << (1 + more)));
    Big high = std::min(Big(center + margin), Big(high_ << (1 + more)));
    if (high - low < w << more) {
      low_ = std::move(low), high_ = std::move(high), k_ = k + more;
      return;
    }
  }
  const bool after = sign(a[0]) == before_;
  low_ = after ? middle : Big(low_ << 1);
  high_ = after ? Big(high_ << 1) : middle;
  k_ = k;
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
