// SPDX-License-Identifier: Apache-2.0
// Signed integers of a fixed number of 64-bit limbs, in two's complement. A product is as wide as both factors
// together, so it cannot overflow. A sum is as wide as its wider term; the caller must leave room for it.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "base/hd.h"

namespace hpccd::exact {

__extension__ typedef unsigned __int128 DoubleLimb;
__extension__ typedef __int128 SignedDoubleLimb;

template <int N>
struct Integer {
  std::array<std::uint64_t, N> limbs;  // least significant first

  Integer() = default;
  HPCCD_HOST_DEVICE Integer(std::int64_t x) {
    fill(static_cast<std::uint64_t>(x >> 63));
    limbs[0] = static_cast<std::uint64_t>(x);
  }
  template <int M>
    requires(M < N)
  HPCCD_HOST_DEVICE Integer(const Integer<M>& x) {
    for (int i = 0; i < M; ++i) limbs[i] = x.limbs[i];
    for (int i = M; i < N; ++i) limbs[i] = x.extension();
  }

  HPCCD_HOST_DEVICE void fill(std::uint64_t x) {
    for (std::uint64_t& limb : limbs) limb = x;
  }
  HPCCD_HOST_DEVICE bool negative() const { return static_cast<std::int64_t>(limbs[N - 1]) < 0; }
  // The value of all further limbs (sign extension).
  HPCCD_HOST_DEVICE std::uint64_t extension() const { return negative() ? ~std::uint64_t{0} : 0; }
};

template <int N>
HPCCD_HOST_DEVICE int sign(const Integer<N>& x) {
  if (x.negative()) return -1;
  std::uint64_t any = 0;
  for (std::uint64_t limb : x.limbs) any |= limb;
  return any != 0;
}

namespace detail {

// a + b, or a - b as a + ~b + 1.
template <bool subtract, int N>
HPCCD_HOST_DEVICE Integer<N> sum(const Integer<N>& a, const Integer<N>& b) {
  Integer<N> s;
  std::uint64_t carry = subtract;
  for (int i = 0; i < N; ++i) {
    const std::uint64_t limb = subtract ? ~b.limbs[i] : b.limbs[i];
    const DoubleLimb x = DoubleLimb{a.limbs[i]} + limb + carry;
    s.limbs[i] = static_cast<std::uint64_t>(x);
    carry = static_cast<std::uint64_t>(x >> 64);
  }
  return s;
}

// Subtracts x from `high` if the flag is set: turns an unsigned product into a signed one.
template <int N, int M>
HPCCD_HOST_DEVICE void subtract_high(Integer<N>& from, const Integer<M>& x, std::uint64_t mask) {
  std::uint64_t borrow = 0;
  for (int i = 0; i < M; ++i) {
    const DoubleLimb d = DoubleLimb{from.limbs[N - M + i]} - (x.limbs[i] & mask) - borrow;
    from.limbs[N - M + i] = static_cast<std::uint64_t>(d);
    borrow = static_cast<std::uint64_t>(d >> 64) & 1;
  }
}

}  // namespace detail

template <int A, int B>
HPCCD_HOST_DEVICE Integer<std::max(A, B)> operator+(const Integer<A>& a, const Integer<B>& b) {
  return detail::sum<false, std::max(A, B)>(a, b);
}
template <int A, int B>
HPCCD_HOST_DEVICE Integer<std::max(A, B)> operator-(const Integer<A>& a, const Integer<B>& b) {
  return detail::sum<true, std::max(A, B)>(a, b);
}
template <int N>
HPCCD_HOST_DEVICE Integer<N>& operator+=(Integer<N>& a, const Integer<N>& b) {
  return a = a + b;
}
template <int N>
HPCCD_HOST_DEVICE Integer<N> operator-(const Integer<N>& a) {
  return Integer<N>(0) - a;
}

template <int A, int B>
HPCCD_HOST_DEVICE_CALL Integer<A + B> operator*(const Integer<A>& a, const Integer<B>& b) {
  Integer<A + B> product;
  if constexpr (A == 1 && B == 1) {
    const SignedDoubleLimb x =
        SignedDoubleLimb{static_cast<std::int64_t>(a.limbs[0])} * static_cast<std::int64_t>(b.limbs[0]);
    product.limbs = {static_cast<std::uint64_t>(x), static_cast<std::uint64_t>(x >> 64)};
    return product;
  }
  product.fill(0);
  HPCCD_ROLLED_ON_DEVICE
  for (int i = 0; i < A; ++i) {
    std::uint64_t carry = 0;
    for (int j = 0; j < B; ++j) {
      const DoubleLimb x = DoubleLimb{a.limbs[i]} * b.limbs[j] + product.limbs[i + j] + carry;
      product.limbs[i + j] = static_cast<std::uint64_t>(x);
      carry = static_cast<std::uint64_t>(x >> 64);
    }
    product.limbs[i + B] = carry;
  }
  detail::subtract_high(product, a, b.extension());
  detail::subtract_high(product, b, a.extension());
  return product;
}

// x * 2^bits with `More` limbs more than x.
template <int More, int N>
HPCCD_HOST_DEVICE_CALL Integer<N + More> shifted(const Integer<N>& x, int bits) {
  Integer<N + More> y;
  const int whole = bits / 64, part = bits % 64;
  const std::uint64_t extension = x.extension();
  const auto limb = [&](int i) { return i < 0 ? 0 : i < N ? x.limbs[static_cast<std::size_t>(i)] : extension; };
  for (int i = 0; i < N + More; ++i) {
    const int from = i - whole;
    y.limbs[i] = part ? limb(from) << part | limb(from - 1) >> (64 - part) : limb(from);
  }
  return y;
}

// x * m, which must fit the type, by the lowest limbs only.
template <int N>
HPCCD_HOST_DEVICE Integer<N> scaled(const Integer<N>& x, std::uint64_t m) {
  Integer<N> y;
  std::uint64_t carry = 0;
  for (int i = 0; i < N; ++i) {
    const DoubleLimb z = DoubleLimb{x.limbs[i]} * m + carry;
    y.limbs[i] = static_cast<std::uint64_t>(z);
    carry = static_cast<std::uint64_t>(z >> 64);
  }
  return y;
}

// An approximation of |x|: a fraction in [0.5, 1), or 0, times a power of two.
template <int N>
HPCCD_HOST_DEVICE_CALL double magnitude_of(const Integer<N>& x, int& exponent) {
  const Integer<N> y = x.negative() ? -x : x;
  int top = N - 1;
  while (top > 0 && y.limbs[top] == 0) --top;
  double d = static_cast<double>(y.limbs[top]);
  if (top > 0) d += 0x1p-64 * static_cast<double>(y.limbs[top - 1]);
  const double fraction = std::frexp(d, &exponent);
  exponent += 64 * top;
  return fraction;
}

}  // namespace hpccd::exact
