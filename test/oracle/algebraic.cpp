// SPDX-License-Identifier: Apache-2.0
#include "algebraic.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace oracle {
namespace {

int sign(const Integer& x) { return x.sign(); }

// 2^(k degree) p(n/2^k): an integer with the sign of p there.
Integer scaled_value(const Polynomial& p, const Integer& n, unsigned k) {
  Integer value = 0;
  for (int i = p.degree(); i >= 0; --i) value = value * n + (p[i] << (k * static_cast<unsigned>(p.degree() - i)));
  return value;
}

// Coefficients of p(x + n), given those of p.
void shift(std::vector<Integer>& p, const Integer& n) {
  for (std::size_t i = 0; i + 1 < p.size(); ++i)
    for (std::size_t j = p.size() - 1; j-- > i;) p[j] += n * p[j + 1];
}

// Signs of the Bernstein coefficients of p on [n/2^k, (n+1)/2^k].
std::vector<int> bernstein_signs(const Polynomial& p, const Integer& n, unsigned k) {
  const int d = p.degree();
  std::vector<Integer> b;  // of p as a polynomial in s, t = (n+s)/2^k, times 2^(k d)
  for (int i = 0; i <= d; ++i) b.push_back(p[i] << (k * static_cast<unsigned>(d - i)));
  if (n != 0) shift(b, n);
  // binomial(d,j) times the j-th coefficient is sum_i binomial(d-i, j-i) b[i].
  std::reverse(b.begin(), b.end());
  shift(b, 1);
  std::vector<int> signs;
  for (int j = 0; j <= d; ++j) signs.push_back(sign(b[static_cast<std::size_t>(d - j)]));
  return signs;
}

bool all_alike(const std::vector<int>& signs) {
  return signs[0] != 0 && std::all_of(signs.begin(), signs.end(), [&](int s) { return s == signs[0]; });
}

int variations(const std::vector<int>& signs) {
  int count = 0, last = 0;
  for (int s : signs) {
    if (s != 0 && last != 0 && s != last) ++count;
    if (s != 0) last = s;
  }
  return count;
}

// Adds the roots in the open interval (n/2^k, (n+1)/2^k) by Descartes' rule: no variation of sign, no root; one, one
// simple root. False where that takes intervals shorter than 2^-deepest, which they are for ever around a multiple
// root.
bool isolate(const Polynomial& p, const Integer& n, unsigned k, unsigned deepest, std::vector<Root>& roots) {
  const std::vector<int> signs = bernstein_signs(p, n, k);
  const int count = variations(signs);
  if (count == 0) return true;
  if (count == 1 && signs.front() != 0 && signs.back() != 0) {
    roots.push_back(Root::between(p, n, k));
    return true;
  }
  if (k == deepest) return false;
  const Integer left = 2 * n, middle = left + 1;
  if (!isolate(p, left, k + 1, deepest, roots)) return false;
  if (scaled_value(p, middle, k + 1) == 0) roots.push_back(Root::exactly(middle, k + 1));
  return isolate(p, middle, k + 1, deepest, roots);
}

// As roots_in_unit_interval; false where two roots are one or closer than 2^-deepest.
bool find_roots(const Polynomial& p, unsigned deepest, std::vector<Root>& roots) {
  if (scaled_value(p, 0, 0) == 0) roots.push_back(Root::exactly(0, 0));
  if (!isolate(p, 0, 0, deepest, roots)) return false;
  if (scaled_value(p, 1, 0) == 0) roots.push_back(Root::exactly(1, 0));
  return true;
}

// The largest double not greater than n/2^k, n >= 0.
double floor_to_double(const Integer& n, unsigned k) {
  if (n == 0) return 0.0;
  const int bits = static_cast<int>(msb(n)) + 1;
  const int exponent = bits - static_cast<int>(k);
  const int precision = std::min(53, exponent + 1074);  // denormal numbers have fewer bits
  if (precision <= 0) return 0.0;
  const int drop = bits - precision;
  const Integer mantissa = drop > 0 ? Integer(n >> static_cast<unsigned>(drop)) : n;
  return std::ldexp(mantissa.convert_to<double>(), std::max(drop, 0) - static_cast<int>(k));
}

}  // namespace

// Quadratic interval refinement (Abbott 2006): a secant guesses the subinterval, exact signs at its two ends
// accept or reject it. A right guess doubles the bits gained next time, a wrong one halves them; one bit is
// bisection.
void Root::refine() {
  const Integer low = scaled_value(p_, n_, k_), high = scaled_value(p_, n_ + 1, k_);
  const unsigned m = subdivision_;
  const unsigned k = k_ + m;
  Integer guess = m == 1 ? Integer(1) : Integer((low << m) / (low - high));
  guess = std::min(guess, Integer((Integer(1) << m) - 1));
  const Integer first = (n_ << m) + guess;
  for (const Integer& end : {first, Integer(first + 1)}) {
    if (scaled_value(p_, end, k) == 0) {
      *this = exactly(end, k);
      return;
    }
  }
  const bool after_first = sign(scaled_value(p_, first, k)) == sign(low);
  const bool before_second = sign(scaled_value(p_, first + 1, k)) == sign(high);
  if (m > 1 && !(after_first && before_second)) {
    subdivision_ = m / 2;
    return;
  }
  n_ = after_first ? first : Integer(first - 1);  // first - 1 only where m is 1: the left half
  k_ = k;
  subdivision_ = 2 * m;
}

int Root::sign_of(const Polynomial& q) {
  if (q.is_zero()) return 0;
  // A common root shows in the common divisor, which costs more than the few refinements that settle most
  // cases.
  bool known_not_common = false;
  while (!exact_) {
    const std::vector<int> signs = bernstein_signs(q, n_, k_);
    if (all_alike(signs)) return signs[0];
    if (k_ >= 60 && !known_not_common) {
      const Polynomial g = common_divisor(p_, q);
      if (g.degree() > 0 && sign(scaled_value(g, n_, k_)) != sign(scaled_value(g, n_ + 1, k_))) return 0;
      known_not_common = true;
    }
    refine();
  }
  return sign(scaled_value(q, n_, k_));
}

double Root::rounded_down() {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  while (!exact_) {
    const double low = floor_to_double(n_, k_);
    const double high = floor_to_double(n_ + 1, k_);
    if (low == high) return low;
    // Where the root is itself a double, both bounds never round alike: ask on which side of it the root
    // lies.
    if (std::nextafter(low, infinity) == high) {
      int exponent;
      const double mantissa = std::ldexp(std::frexp(high, &exponent), 53);
      const Integer n = static_cast<long long>(mantissa);
      const int shift = 53 - exponent;
      const int side = sign(scaled_value(p_, n, static_cast<unsigned>(shift)));
      return side == 0 || side == sign(scaled_value(p_, n_, k_)) ? high : low;
    }
    refine();
  }
  return floor_to_double(n_, k_);
}

std::vector<Root> roots_in_unit_interval(const Polynomial& p) {
  std::vector<Root> roots;
  if (find_roots(p, 32, roots)) return roots;
  roots.clear();
  find_roots(square_free_part(p), std::numeric_limits<unsigned>::max(), roots);
  return roots;
}

}  // namespace oracle
