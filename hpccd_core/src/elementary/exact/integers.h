// SPDX-License-Identifier: Apache-2.0
// Integers of the exact tier: of fixed size for all but the widest coordinates, else of any size. The coordinates of
// one query become integers by a power of two, one for each axis.
#pragma once

#include <bit>
#include <boost/multiprecision/cpp_int.hpp>
#include <limits>

#include "elementary/exact/fixed_integer.h"

namespace hpccd::exact {

using Big = boost::multiprecision::number<boost::multiprecision::cpp_int_backend<>, boost::multiprecision::et_off>;

inline int sign(const Big& x) { return x.sign(); }

// Of a number that is not zero.
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

// What a template needs to know of the integer type of its coordinates.
template <class Z>
struct Widths;
template <int N>
struct Widths<Integer<N>> {
  // A quadratic's coefficients have at most 2 b + 7 bits, a cubic's 3 b + 10 (query.h); all that is computed from them
  // fits its type if b is at most this.
  static constexpr int coordinate_bits = 64 * N - 4;
  static constexpr bool any_size = false;
  template <int More>
  using Plus = Integer<N + More>;
  using Time = Integer<1>;
};
template <>
struct Widths<Big> {
  static constexpr bool any_size = true;
  template <int More>
  using Plus = Big;
  using Time = Big;
};
template <class Z, int More>
using Plus = typename Widths<Z>::template Plus<More>;  // with room for `More` limbs more
template <class Z>
using Time = typename Widths<Z>::Time;  // of a numerator of a dyadic time

// A finite double as mantissa * 2^exponent, an odd mantissa or zero.
struct OddMantissa {
  std::int64_t mantissa = 0;
  int exponent = 0;
  OddMantissa() = default;
  explicit OddMantissa(double x) {
    const auto bits = std::bit_cast<std::uint64_t>(x);
    const int field = static_cast<int>(bits >> 52 & 0x7ff);
    std::uint64_t m = bits & ((std::uint64_t{1} << 52) - 1);
    if (field) m |= std::uint64_t{1} << 52;
    if (!m) return;
    const int zeros = std::countr_zero(m);
    exponent = std::max(field, 1) - 1075 + zeros;
    mantissa = static_cast<std::int64_t>(m >> zeros);
    if (bits >> 63) mantissa = -mantissa;
  }
};

// The exponents of the lowest and the highest bit in use among doubles (zeros apart).
struct BitRange {
  int low = 4096, high = -4096;
  void include(const OddMantissa& x) {
    if (!x.mantissa) return;
    low = std::min(low, x.exponent);
    high = std::max(high, x.exponent + 64 - std::countl_zero(static_cast<std::uint64_t>(std::abs(x.mantissa))));
  }
  void include(const BitRange& x) {
    low = std::min(low, x.low);
    high = std::max(high, x.high);
  }
  int bits() const { return high > low ? high - low : 1; }
};

// x * 2^-low, which must be an integer.
template <class Z>
Z scaled_integer(const OddMantissa& x, int low) {
  return x.mantissa ? Z(shifted<0>(Z(x.mantissa), x.exponent - low)) : Z(0);
}

}  // namespace hpccd::exact
