// SPDX-License-Identifier: Apache-2.0
#include "elementary/exact/wide/part.h"

#include <algorithm>

namespace hpccd::exact::wide {
namespace {

int highest_bit(const Big& x) { return static_cast<int>(msb(x.sign() < 0 ? Big(-x) : x)); }

void drop_common_power_of_two(Numbers& a) {
  int common = std::numeric_limits<int>::max();
  for (const Big& x : a)
    if (!x.is_zero()) common = std::min(common, static_cast<int>(lsb(x.sign() < 0 ? Big(-x) : x)));
  if (common < 64 || common == std::numeric_limits<int>::max()) return;
  for (Big& x : a)
    if (!x.is_zero()) x >>= common;
}

constexpr std::size_t most_coefficients = 7;

// Of polynomials of degree n: the Bernstein coefficients times the binomial ones.
template <class Number>
void to_bernstein(Number* a, std::size_t n) {
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t m = 1; m <= n - i; ++m) a[m] += a[m - 1];
}

// Their signs in double precision; false where one stays open.
bool rounded_signs(const Numbers& a, int* signs) {
  const std::size_t n = a.size() - 1;
  double b[most_coefficients];
  int e[most_coefficients], most = std::numeric_limits<int>::min();
  for (std::size_t i = 0; i <= n; ++i) {
    b[i] = sign(a[i]) * magnitude_of(a[i], e[i]);
    if (b[i] != 0) most = std::max(most, e[i]);
  }
  for (std::size_t i = 0; i <= n; ++i) b[i] = std::ldexp(b[i], std::max(e[i] - most, -1000));
  signs[0] = sign(a[0]);
  to_bernstein(b, n);
  // Each is a sum of at most 64 numbers below 1, added up with at most 6 roundings.
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
  to_bernstein(a.data(), a.size() - 1);
  for (std::size_t i = 0; i < a.size(); ++i) signs[i] = sign(a[i]);
}

// About -num 2^h / den, rounded.
Big rounded_ratio(Big num, Big den, int h) {
  if (num.is_zero()) return 0;
  if (den.sign() < 0) num = -num, den = -den;
  num = -num << h;
  // As many bits of both as an error below one asks for.
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
  const auto succeeds = [&] {
    // Where as many roots as there are variations lie together, far from all others, the derivative that has one of
    // them left is almost a straight line.
    const std::size_t v = variations_;
    const int h = gain_ + 2;
    const Big cells = Big(1) << h;
    if (v < a_.size() && !a_[v].is_zero()) {
      const Big center = rounded_ratio(a_[v - 1], static_cast<int>(v) * a_[v], h);
      if (center >= -1 && center <= cells + 1 && move_to(std::clamp(Big(center - 2), Big(0), Big(cells - 4)), h, 2))
        return true;
    }
    // Roots at an end, or next to it on either side, are not all among the variations.
    return move_to(0, gain_, 0) || move_to((Big(1) << gain_) - 1, gain_, 0);
  };
  const bool moved = succeeds();
  gain_ = moved ? 2 * gain_ : std::max(1, gain_ / 2);
  return moved;
}

bool Part::root_at_end() const {
  Big sum = 0;
  for (const Big& x : a_) sum += x;
  return sum.is_zero();
}

Part::Halves Part::halves() const {
  Halves h;
  for (Part* half : {&h.first, &h.second}) {
    half->gain_ = gain_;
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
