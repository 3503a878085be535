// SPDX-License-Identifier: Apache-2.0
// Coordinates as integers: the coordinates of one query times a power of two, one for each axis.
#pragma once

#include <bit>

#include "base/bits.h"
#include "elementary/exact/fixed_integer.h"
#if !defined(__CUDACC__)  // GPUs have no integers of any size
#include "elementary/exact/big_integers.h"
#endif

namespace hpccd::exact {

// The properties of the integer type of coordinates.
template <class Z>
struct Widths;
template <int N>
struct Widths<Integer<N>> {
  // A quadratic's coefficients have at most 2 b + 7 bits, a cubic's 3 b + 10 (query.h); everything computed from them
  // fits its type if b is at most this.
  static constexpr int coordinate_bits = 64 * N - 4;
  static constexpr bool any_size = false;
  template <int More>
  using Plus = Integer<N + More>;
  using Time = Integer<1>;
};
#if !defined(__CUDACC__)
template <>
struct Widths<Big> {
  static constexpr bool any_size = true;
  template <int More>
  using Plus = Big;
  using Time = Big;
};
#endif
template <class Z, int More>
using Plus = typename Widths<Z>::template Plus<More>;  // with `More` additional limbs
template <class Z>
using Time = typename Widths<Z>::Time;  // of a numerator of a dyadic time

// A finite double as mantissa * 2^exponent, an odd mantissa or zero.
struct OddMantissa {
  std::int64_t mantissa = 0;
  int exponent = 0;
  OddMantissa() = default;
  HPCCD_HOST_DEVICE explicit OddMantissa(double x) {
    const auto bits = std::bit_cast<std::uint64_t>(x);
    const int field = static_cast<int>(bits >> 52 & 0x7ff);
    std::uint64_t m = bits & ((std::uint64_t{1} << 52) - 1);
    if (field) m |= std::uint64_t{1} << 52;
    if (!m) return;
    const int zeros = trailing_zeros(m);
    exponent = std::max(field, 1) - 1075 + zeros;
    mantissa = static_cast<std::int64_t>(m >> zeros);
    if (bits >> 63) mantissa = -mantissa;
  }
};

// The exponents of the lowest and the highest bit in use among doubles (except zeros).
struct BitRange {
  int low = 4096, high = -4096;
  HPCCD_HOST_DEVICE void include(const OddMantissa& x) {
    if (!x.mantissa) return;
    low = std::min(low, x.exponent);
    high = std::max(
        high, x.exponent + 64 - leading_zeros(static_cast<std::uint64_t>(x.mantissa < 0 ? -x.mantissa : x.mantissa)));
  }
  HPCCD_HOST_DEVICE void include(const BitRange& x) {
    low = std::min(low, x.low);
    high = std::max(high, x.high);
  }
  HPCCD_HOST_DEVICE int bits() const { return high > low ? high - low : 1; }
};

// x * 2^-low, which must be an integer.
template <class Z>
HPCCD_HOST_DEVICE Z scaled_integer(const OddMantissa& x, int low) {
  return x.mantissa ? Z(shifted<0>(Z(x.mantissa), x.exponent - low)) : Z(0);
}

}  // namespace hpccd::exact
