// SPDX-License-Identifier: Apache-2.0
// Integers of the exact tier. Coordinates of one query become integers by a common power of two.
#pragma once

#include <array>
#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <cstdint>

namespace hpccd::exact {

// Without memory allocation: enough for coordinates of `fixed_coordinate_bits` bits. Their cubic has
// 3 * 152 + 3 bits, evaluated at dyadic times of `fixed_time_bits` bits: 459 + 3 * 128 = 843 < 1024.
using Fixed = boost::multiprecision::number<
    boost::multiprecision::cpp_int_backend<1024, 1024, boost::multiprecision::signed_magnitude,
                                           boost::multiprecision::unchecked, void>,
    boost::multiprecision::et_off>;
inline constexpr int fixed_coordinate_bits = 150;
inline constexpr int fixed_time_bits = 128;

// Of any size: for coordinates that spread over more bits, and for greatest common divisors.
using Big = boost::multiprecision::number<boost::multiprecision::cpp_int_backend<>, boost::multiprecision::et_off>;

template <class Z>
int sign(const Z& z) {
  return z.sign();
}

// The exponents of the lowest and the highest bit in use among finite doubles (zeros apart).
struct BitRange {
  int low = 4096, high = -4096;
  void include(double x) {
    if (x == 0) return;
    int e;
    const double fraction = std::frexp(x, &e);
    auto mantissa = static_cast<std::int64_t>(std::ldexp(std::fabs(fraction), 53));
    low = std::min(low, e - 53 + __builtin_ctzll(static_cast<unsigned long long>(mantissa)));
    high = std::max(high, e);
  }
  int bits() const { return high > low ? high - low : 1; }
};

// x * 2^-low, which must be an integer.
template <class Z>
Z scaled_integer(double x, int low) {
  if (x == 0) return Z(0);
  int e;
  const double fraction = std::frexp(x, &e);
  auto mantissa = static_cast<std::int64_t>(std::ldexp(fraction, 53));
  const int shift = e - 53 - low;
  if (shift >= 0) return Z(mantissa) << shift;
  return Z(mantissa / (std::int64_t{1} << -shift));  // the bits dropped are zero
}

}  // namespace hpccd::exact
