// SPDX-License-Identifier: Apache-2.0
// Integers of any size, for coordinates with the widest range of exponents. CPUs only.
#pragma once

#include <bit>
#include <boost/multiprecision/cpp_int.hpp>
#include <limits>

#include "elementary/exact/fixed_integer.h"

namespace hpccd::exact {

using Big = boost::multiprecision::number<boost::multiprecision::cpp_int_backend<>, boost::multiprecision::et_off>;

inline int sign(const Big& x) { return x.sign(); }

// For a number that is not zero.
inline int highest_bit(const Big& x) {
  const auto& limbs = x.backend();
  const int top = static_cast<int>(limbs.size()) - 1;
  return 64 * top + 63 - std::countl_zero(static_cast<std::uint64_t>(limbs.limbs()[top]));
}

inline Big to_big(const Big& x) { return x; }
template <int N>
Big to_big(const Integer<N>& x) {
  const Integer<N> size = x.negative() ? -x : x;
  Big y = 0;
  y.backend().resize(N, N);
  std::copy(size.limbs.begin(), size.limbs.end(), y.backend().limbs());
  y.backend().normalize();
  return x.negative() ? Big(-y) : y;
}

template <int More>
Big shifted(const Big& x, int bits) {
  return x << bits;
}

inline double magnitude_of(const Big& x, int& exponent) {
  exponent = 0;
  if (x.is_zero()) return 0;
  const Big y = abs(x);
  const int excess = std::max(0, static_cast<int>(boost::multiprecision::msb(y)) - 63);
  const double fraction = std::frexp(static_cast<double>(static_cast<std::uint64_t>(y >> excess)), &exponent);
  exponent += excess;
  return fraction;
}

}  // namespace hpccd::exact
