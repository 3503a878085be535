// SPDX-License-Identifier: Apache-2.0
#include "integers.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace oracle {
namespace {

// x = mantissa * 2^exponent with an odd mantissa, or 0.
std::pair<long long, int> odd_mantissa(double x) {
  if (x == 0.0) return {0, std::numeric_limits<int>::max()};
  int exponent;
  auto mantissa = static_cast<long long>(std::ldexp(std::frexp(x, &exponent), 53));
  const int zeros = __builtin_ctzll(static_cast<unsigned long long>(mantissa));
  return {mantissa / (1LL << zeros), exponent - 53 + zeros};
}

int bits_of(const Integer& n) { return static_cast<int>(msb(n)) + 1; }

}  // namespace

Integers to_integers(const std::vector<double>& numbers) {
  int lowest = std::numeric_limits<int>::max();
  for (const double x : numbers) lowest = std::min(lowest, odd_mantissa(x).second);
  Integers all{{}, lowest == std::numeric_limits<int>::max() ? 0 : lowest};
  for (const double x : numbers) {
    const auto [mantissa, exponent] = odd_mantissa(x);
    all.values.push_back(mantissa == 0 ? Integer(0)
                                       : Integer(Integer(mantissa) << static_cast<unsigned>(exponent - lowest)));
  }
  return all;
}

double nearest_double(const Integer& n, int exponent) {
  if (n == 0) return 0.0;
  const int drop = std::max(bits_of(n) - 53, -1074 - exponent);  // denormal numbers have fewer bits
  if (drop <= 0) return std::ldexp(n.convert_to<double>(), exponent);
  Integer mantissa = n >> static_cast<unsigned>(drop);
  const Integer twice_rest = (n - (mantissa << static_cast<unsigned>(drop))) << 1, one = Integer(1)
                                                                                         << static_cast<unsigned>(drop);
  if (twice_rest > one || (twice_rest == one && bit_test(mantissa, 0))) ++mantissa;
  return std::ldexp(mantissa.convert_to<double>(), exponent + drop);
}

double nearest_root(const Integer& numerator, const Integer& denominator, int exponent) {
  if (numerator == 0) return 0.0;
  // 64 bits of the root or more, and one below them that tells whether anything follows.
  const int short_of = 128 + bits_of(denominator) - bits_of(numerator);
  const int more = std::max(0, (short_of + 1) / 2);
  const Integer shifted = numerator << static_cast<unsigned>(2 * more), square = shifted / denominator;
  const Integer root = sqrt(square);
  const bool exact = root * root == square && square * denominator == shifted;
  return nearest_double((root << 1) + (exact ? 0 : 1), exponent - more - 1);
}

}  // namespace oracle
