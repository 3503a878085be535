// SPDX-License-Identifier: Apache-2.0
// Several real numbers in the lanes of one register (GCC/Clang vector extension). Each lane computes exactly what
// real.h computes for one number: only +, -, *, /, sqrt, comparison and select, with contraction switched off.
// Every translation unit that includes this has a width of its own, so no instantiation is shared between
// instruction sets.
#pragma once

#include <cstdint>
#include <limits>
#include <type_traits>

#include "base/real.h"

namespace hpccd {

template <class T, int W>
struct LaneMask {
  using Int = std::conditional_t<sizeof(T) == 8, std::int64_t, std::int32_t>;
  typedef Int Vec __attribute__((vector_size(sizeof(T) * W)));
  Vec v;
  HPCCD_HD friend LaneMask operator&&(LaneMask a, LaneMask b) { return {a.v & b.v}; }
  HPCCD_HD friend LaneMask operator||(LaneMask a, LaneMask b) { return {a.v | b.v}; }
  HPCCD_HD friend LaneMask operator!(LaneMask a) { return {~a.v}; }
};

template <class T, int W>
struct Lanes {
  typedef T Vec __attribute__((vector_size(sizeof(T) * W)));
  using Mask = LaneMask<T, W>;
  Vec v;
  HPCCD_HD Lanes() = default;
  HPCCD_HD Lanes(Vec x) : v(x) {}
  HPCCD_HD explicit Lanes(double x) : v(Vec{} + static_cast<T>(x)) {}
  HPCCD_HD friend Lanes operator+(Lanes a, Lanes b) { return Lanes(a.v + b.v); }
  HPCCD_HD friend Lanes operator-(Lanes a, Lanes b) { return Lanes(a.v - b.v); }
  HPCCD_HD friend Lanes operator*(Lanes a, Lanes b) { return Lanes(a.v * b.v); }
  HPCCD_HD friend Lanes operator/(Lanes a, Lanes b) { return Lanes(a.v / b.v); }
  HPCCD_HD friend Lanes operator-(Lanes a) { return Lanes(-a.v); }
  HPCCD_HD friend Mask operator<(Lanes a, Lanes b) { return {a.v < b.v}; }
  HPCCD_HD friend Mask operator>(Lanes a, Lanes b) { return {a.v > b.v}; }
  HPCCD_HD friend Mask operator<=(Lanes a, Lanes b) { return {a.v <= b.v}; }
  HPCCD_HD friend Mask operator>=(Lanes a, Lanes b) { return {a.v >= b.v}; }
};

template <class T, int W>
HPCCD_HD Lanes<T, W> select(LaneMask<T, W> m, Lanes<T, W> a, Lanes<T, W> b) {
  return Lanes<T, W>(m.v ? a.v : b.v);
}

// The same except for the sign of zero, in one operation instead of three.
template <class T, int W>
HPCCD_HD Lanes<T, W> magnitude(Lanes<T, W> a) {
  using Bits = typename LaneMask<T, W>::Vec;
  constexpr auto all_but_sign = std::numeric_limits<typename LaneMask<T, W>::Int>::max();
  return Lanes<T, W>((typename Lanes<T, W>::Vec)((Bits)a.v & all_but_sign));
}

// bits(mask) and, if a set has it for a whole register, square_root(lanes) are defined by the instruction set.
template <class T, int W>
HPCCD_HD bool any(LaneMask<T, W> m) {
  return bits(m) != 0;
}

template <class T, int W>
HPCCD_HD Lanes<T, W> square_root(Lanes<T, W> x) {
  Lanes<T, W> r;
  for (int i = 0; i < W; ++i) r.v[i] = square_root(x.v[i]);
  return r;
}

template <class T, int W>
struct RealTraits<Lanes<T, W>> {
  using Scalar = T;
  using Mask = LaneMask<T, W>;
  static constexpr int width = W;
};

}  // namespace hpccd
