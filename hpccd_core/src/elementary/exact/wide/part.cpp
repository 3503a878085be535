// SPDX-License-Identifier: Apache-2.0
#include "elementary/exact/wide/part.h"

#include <algorithm>

namespace hpccd::exact::wide {
namespace {

void drop_common_power_of_two(Numbers& a) {
  int common = std::numeric_limits<int>::max();
  for (const Big& x : a)
    if (!x.is_zero()) common = std::min(common, static_cast<int>(lsb(x.sign() < 0 ? Big(-x) : x)));
  if (common < 64 || common == std::numeric_limits<int>::max()) return;
  for (Big& x : a)
    if (!x.is_zero()) x >>= common;
}

constexpr std::size_t most_coefficients = 7;

// The coefficients divided by one power of two, the largest about one.
void rounded(const Numbers& a, double* p) {
  int e[most_coefficients], most = std::numeric_limits<int>::min();
  for (std::size_t i = 0; i < a.size(); ++i) {
    p[i] = sign(a[i]) * magnitude_of(a[i], e[i]);
    if (p[i] != 0) most = std::max(most, e[i]);
  }
  for (std::size_t i = 0; i < a.size(); ++i) p[i] = std::ldexp(p[i], std::max(e[i] - most, -1000));
}

// Their signs in double precision; false if one is undecided.
bool rounded_signs(const Numbers& a, int* signs) {
  const std::size_t n = a.size() - 1;
  double b[most_coefficients];
  rounded(a, b);
  signs[0] = sign(a[0]);
  to_bernstein(b, static_cast<int>(n));
  // Each is a sum of at most 35 numbers below 1, each rounded once and added up with at most 12 rounding errors.
  constexpr double error = 64 * 8 * 0x1p-52;
  for (std::size_t i = 1; i <= n; ++i) {
    if (std::fabs(b[i]) <= error) return false;
    signs[i] = b[i] < 0 ? -1 : 1;
  }
  return true;
}

void bernstein_signs(const Numbers& p, int* signs) {
  if (rounded_signs(p, signs)) return;
  Numbers a = p;
  to_bernstein(a.data(), static_cast<int>(a.size()) - 1);
  for (std::size_t i = 0; i < a.size(); ++i) signs[i] = sign(a[i]);
}

// An approximation of -num 2^h / den.
Big rounded_ratio(Big num, Big den, int h) {
  if (num.is_zero()) return 0;
  if (den.sign() < 0) num = -num, den = -den;
  num = -num << h;
  // As many bits of both as an error below one requires.
  const int excess = highest_bit(den) - std::max(0, highest_bit(num) - highest_bit(den) + 1) - 4;
  if (excess > 0) num >>= excess, den >>= excess;
  return num / den;
}

}  // namespace

Window Window::part(const Big& j, int h, int e) const {
  const int fine = w + h, grid = std::max(k, fine);
  return {(low << (grid - k)) + (j << (grid - fine)), grid, fine - e};
}

Numbers seen_on_part(const Numbers& a, const Big& j, int h, int e) {
  Numbers b = a;
  const int n = static_cast<int>(a.size()) - 1;
  for (int i = 0; i < n; ++i) b[i] <<= (n - i) * h;
  if (j == 1) {
    for (int i = 0; i < n; ++i)
      for (int r = n; r-- > i;) b[r] += b[r + 1];
  } else if (!j.is_zero()) {
    for (int i = 0; i < n; ++i)
      for (int r = n; r-- > i;) b[r] += j * b[r + 1];
  }
  if (e)
    for (int i = 1; i <= n; ++i) b[i] <<= e * i;
  drop_common_power_of_two(b);
  return b;
}

Numbers seen(Coefficients p, const Window& window) {
  return seen_on_part({p.begin(), p.end()}, window.low, window.k, window.k - window.w);
}

int variations(const Numbers& a) {
  int signs[most_coefficients];
  bernstein_signs(a, signs);
  int v = 0, last = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    v += signs[i] * last < 0;
    if (signs[i]) last = signs[i];
  }
  return v;
}

int sign_inside(const Numbers& a) {
  int signs[most_coefficients];
  bernstein_signs(a, signs);
  int all = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (signs[i] * all < 0) return 0;
    if (signs[i]) all = signs[i];
  }
  return all;
}

Part::Part(Coefficients p, Window window) : window_(std::move(window)), a_(seen(p, window_)) {
  drop_root_at_begin();
  variations_ = wide::variations(a_);
}

void Part::drop_root_at_begin() {
  const auto first = std::ranges::find_if(a_, [](const Big& x) { return !x.is_zero(); });
  a_.erase(a_.begin(), first);
}

bool Part::move_to(const Big& j, int h, int e) {
  Numbers b = seen_on_part(a_, j, h, e);
  if (wide::variations(b) != variations_) return false;
  a_ = std::move(b);
  window_ = window_.part(j, h, e);
  return true;
}

bool Part::narrow() {
  if (variations_ == 1 && jump()) return true;
  int gain = std::min(gain_, most_gain());
  const bool inside = gain > 0 && to_cluster(gain);
  if (!inside) gain = gain_;
  const bool moved = inside || (ends_ && to_end(gain));
  ends_ = !inside;
  gain_ = moved ? 2 * gain : std::max(1, gain / 2);
  return moved;
}

// If as many roots as there are variations form a cluster, far from all others, the derivative with one root in the
// cluster is almost linear.
bool Part::to_cluster(int gain) {
  const std::size_t v = variations_;
  if (v >= a_.size() || a_[v].is_zero()) return false;
  const int h = gain + 2;
  const Big cells = Big(1) << h, center = rounded_ratio(a_[v - 1], static_cast<int>(v) * a_[v], h);
  if (center < -1 || center > cells + 1) return false;
  return move_to(std::clamp(Big(center - 2), Big(0), Big(cells - 4)), h, 2);
}

// Roots at an end, or next to it on either side, are not all counted by the variations.
bool Part::to_end(int gain) { return move_to(0, gain, 0) || move_to((Big(1) << gain) - 1, gain, 0); }

// For a single root: by doubles, with as many bits as they determine.
bool Part::jump() {
  double p[most_coefficients], size = 0, s = 0.5, low = 0, high = 1, slope = 0;
  rounded(a_, p);
  const int n = static_cast<int>(a_.size()) - 1;
  for (int i = 0; i <= n; ++i) size += std::fabs(p[i]);
  for (int turn = 0; turn < 60; ++turn) {
    double value = p[n];
    slope = 0;
    for (int i = n; i-- > 0;) slope = slope * s + value, value = value * s + p[i];
    ((value < 0) == (a_[0] < 0) ? low : high) = s;
    double next = s - value / slope;
    if (!(next > low && next < high)) next = low + 0.5 * (high - low);
    if (std::fabs(next - s) < 0x1p-50) break;
    s = next;
  }
  int bits;
  std::frexp(std::fabs(slope) / size, &bits);
  const int h = std::min(bits + 46, 46);
  if (h < gain_ + 4) return false;
  const std::int64_t cells = std::int64_t{1} << h;
  const auto at = static_cast<std::int64_t>(std::ldexp(s, h));
  if (!move_to(std::clamp<std::int64_t>(at - 2, 0, cells - 4), h, 2)) return false;
  gain_ = h;
  return true;
}

// The largest gain of bits: two roots c +- r, or c +- i r, whose r is known to double precision.
int Part::most_gain() const {
  constexpr int any = std::numeric_limits<int>::max() / 4;
  if (variations_ != 2 || a_.size() < 3) return any;
  double p[most_coefficients];
  rounded(a_, p);
  const double square = (p[1] * p[1] - 4 * p[0] * p[2]) / (4 * p[2] * p[2]);
  constexpr double least = 0x1p-44;
  if (!(std::fabs(square) > least * std::max(1.0, 1 / std::fabs(p[2])))) return any;
  int exponent;
  std::frexp(square, &exponent);
  return -(exponent / 2) - 2;
}

bool Part::root_at_end() const {
  Big sum = 0;
  for (const Big& x : a_) sum += x;
  return sum.is_zero();
}

Part::Halves Part::halves() const {
  Halves h;
  for (Part* half : {&h.first, &h.second}) {
    half->gain_ = gain_, half->ends_ = ends_;
    half->window_ = window_.part(half == &h.first ? 0 : 1, 1, 0);
  }
  h.first.a_ = seen_on_part(a_, 0, 1, 0);
  h.second.a_ = seen_on_part(h.first.a_, 1, 0, 0);
  h.root_between = h.second.a_[0].is_zero();
  h.second.drop_root_at_begin();
  for (Part* half : {&h.first, &h.second}) half->variations_ = wide::variations(half->a_);
  return h;
}

}  // namespace hpccd::exact::wide
