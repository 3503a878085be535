// SPDX-License-Identifier: Apache-2.0
#include "elementary/exact/wide/root.h"

namespace hpccd::exact::wide {
namespace {

int floor_of_ratio(int a, int b) { return a >= 0 ? a / b : -((b - 1 - a) / b); }

// An e such that p, which is not zero at 0, has no root within a distance of 2^e: there each other term is less than a
// smaller power of one half of the constant one.
int distance_without_root(Coefficients p) {
  int e = std::numeric_limits<int>::max();
  for (int i = 1; i <= degree_of(p); ++i)
    if (!p[i].is_zero()) e = std::min(e, floor_of_ratio(highest_bit(p[0]) - highest_bit(p[i]) - 1, i) - 1);
  return e;
}

// p(2^e x) times a power of two.
std::vector<Big> stretched(Coefficients p, int e) {
  std::vector<Big> q;
  for (int i = 0; i <= degree_of(p); ++i) q.push_back(p[i] << (e < 0 ? (i - degree_of(p)) * e : i * e));
  return q;
}

int sign_at_distance(Coefficients p, bool upwards, int e) {
  return sign_at_dyadic(stretched(p, e), upwards ? 1 : -1, 0);
}

// Scales both to the power of two of the finer one.
void align(Dyadic& x, Dyadic& y) {
  if (x.k < y.k) return align(y, x);
  y.m <<= x.k - y.k;
  y.k = x.k;
}

bool not_above(Dyadic x, Dyadic y) {
  align(x, y);
  return x.m <= y.m;
}

}  // namespace

Root::Root(Coefficients p, const Dyadic& low, const Dyadic& high, int before)
    : of_(p.begin(), p.end()), before_(before) {
  Dyadic first = low, last = high;
  align(first, last);
  low_ = std::move(first.m), high_ = std::move(last.m), k_ = first.k;
}

Dyadic Root::absolute(const Big& offset) const {
  Dyadic from = base_, by{offset, unit_ + k_};
  align(from, by);
  return {from.m + by.m, from.k};
}

std::vector<Big> Root::seen(Coefficients q) const {
  if (base_.m.is_zero()) return stretched(q, -unit_);
  const auto a = seen_from(q, base_.m, base_.k);
  return stretched({a.data(), q.size()}, base_.k - unit_);
}

bool Root::changes_sign(Coefficients q) const {
  const auto local = seen(q);
  return sign_at_dyadic(local, low_, k_) * sign_at_dyadic(local, high_, k_) < 0;
}

bool Root::surely_holds(const Root& other) const {
  // The ends of an interval do not belong to it: an exact root could be one of them.
  return !exact_ && !other.exact_ && not_above(low(), other.low()) && not_above(other.high(), high());
}

void Root::become_exact(Dyadic x) { *this = Root(std::move(x)); }

void Root::set_factor(std::vector<Big> factor) {
  of_ = std::move(factor);
  local_ = seen(of_);
  before_ = sign_at_dyadic(local_, low_, k_);
}

void Root::set_base(Dyadic base, Big low, Big high, int unit) {
  base_ = std::move(base), unit_ = unit;
  low_ = std::move(low), high_ = std::move(high), k_ = 0;
  has_base_ = true;
  local_ = seen(of_);
}

void Root::narrow() {
  if (has_base_)
    step();
  else
    approach();
}

// Narrows the root to an interval of 9 to 28 cells of a grid that is no finer than the distance from the ends requires.
// All other roots, complex ones included, are at least about as far from it as the nearer end was, where p has an
// extremum or inflects. From here on steps converge.
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
  Dyadic first{(low_ >> excess) + 2, k}, last{((high_ - 1) >> excess) - 1, k};
  const int at_first = sign_at_dyadic(of_, first.m, k);
  if (at_first == 0) return become_exact(std::move(first));
  if (at_first != before_) return approach_from({low_, k_}, true, excess + 1);
  const int at_last = sign_at_dyadic(of_, last.m, k);
  if (at_last == 0) return become_exact(std::move(last));
  if (at_last == before_) return approach_from({high_, k_}, false, excess + 1);
  Big cells = last.m - first.m;
  set_base(std::move(first), 0, std::move(cells), k);
}

// The root is nearer than 2^limit / 2^k to that end of the interval.
void Root::approach_from(const Dyadic& end, bool upwards, int limit) {
  const auto a = seen_from(of_, end.m, end.k);
  const Coefficients local(a.data(), of_.size());
  const int at_end = upwards ? before_ : -before_;
  int below = distance_without_root(local), above = limit;
  for (int step = 1; below + step < above; step *= 2) {
    if (sign_at_distance(local, upwards, below + step) == at_end)
      below += step;
    else
      above = below + step;
  }
  while (above - below > 1) {
    const int middle = below + (above - below) / 2;
    (sign_at_distance(local, upwards, middle) == at_end ? below : above) = middle;
  }
  // The distance is in (8, 16] cells.
  const int unit = end.k - (below - 3);
  if (upwards)
    set_base(end, 8, 17, unit);
  else
    set_base(end, -17, -8, unit);
}

// Newton's method on the whole interval: with p = a0 + a1 s + a2 s^2 + a3 s^3 around its middle, the root is at s = -a0
// / (a1 + d), and |d| <= |a2| w + |a3| w^2 for all |s| <= w. One evaluation per doubling of the bits, at half the bits
// that it yields. Halves the interval if that gains more.
void Root::step() {
  const int degree = degree_of(local_), k = k_ + 1;
  const Big middle = low_ + high_, w = high_ - low_;
  const auto a = seen_from(local_, middle, k);
  if (a[0].is_zero()) {
    k_ = k;
    return become_exact(absolute(middle));
  }
  Big d = 0;
  for (int i = degree; i > 1; --i) d = (d + abs(a[i])) * w;
  const Big least = abs(a[1]) - d;
  if (sign(least) > 0) {
    // The error of -a0 / a1 is below 2^e. Bits that would make later steps more expensive than all previous ones are
    // dropped.
    const int most = 64 + k_;
    const int e = d.is_zero() ? -most : highest_bit(a[0]) + highest_bit(d) + 2 - highest_bit(a[1]) - highest_bit(least);
    const int more = std::clamp(-e, 0, most);
    Big num = -a[0] << more, den = a[1];
    // As many bits of both as an error below one requires.
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
  for (;; narrow()) {
    const Dyadic first = low(), last = high();
    const int excess = first.k - time_bits;
    if (exact_) return static_cast<std::int64_t>(excess < 0 ? Big(first.m << -excess) : Big(first.m >> excess));
    if (excess < 0) continue;
    const Big before = first.m >> excess, after = (last.m - 1) >> excess;
    if (before == after) return static_cast<std::int64_t>(before);
    if (after - before > 1) continue;
    const int s = sign_at_dyadic(of_, after, time_bits);
    return static_cast<std::int64_t>(s == 0 || s == before_ ? after : before);
  }
}

}  // namespace hpccd::exact::wide
