// SPDX-License-Identifier: Apache-2.0
// Several real numbers in the lanes of one register (GCC/Clang vector extension). Each lane computes exactly what
// real.h computes for one number: only +, -, *, /, sqrt, comparison and select, with contraction switched off.
// Every translation unit that includes this has a width of its own, so no instantiation is shared between
// instruction sets.
#pragma once

#include <cstdint>
#if defined(__AVX512F__) || defined(__AVX2__)
#include <immintrin.h>
#endif

#include "base/real.h"

namespace hpccd {

template <class T, int W>
struct LaneMask {
  using Int = std::conditional_t<sizeof(T) == 8, std::int64_t, std::int32_t>;
  typedef Int Vec __attribute__((vector_size(sizeof(T) * W)));
  Vec v;
  HPCCD_HD friend LaneMask operator&(LaneMask a, LaneMask b) { return {a.v & b.v}; }
  HPCCD_HD friend LaneMask operator|(LaneMask a, LaneMask b) { return {a.v | b.v}; }
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

template <class T, int W>
HPCCD_HD unsigned bits(LaneMask<T, W> m) {
#if defined(__AVX512DQ__)
  if constexpr (sizeof(m.v) == 64 && sizeof(T) == 8) return _mm512_movepi64_mask((__m512i)m.v);
  if constexpr (sizeof(m.v) == 64 && sizeof(T) == 4) return _mm512_movepi32_mask((__m512i)m.v);
#endif
#if defined(__AVX2__)
  if constexpr (sizeof(m.v) == 32 && sizeof(T) == 8) return static_cast<unsigned>(_mm256_movemask_pd((__m256d)m.v));
  if constexpr (sizeof(m.v) == 32 && sizeof(T) == 4) return static_cast<unsigned>(_mm256_movemask_ps((__m256)m.v));
#endif
  unsigned r = 0;
  for (int i = 0; i < W; ++i) r |= (m.v[i] ? 1u : 0u) << i;
  return r;
}

template <class T, int W>
HPCCD_HD bool any(LaneMask<T, W> m) {
  return bits(m) != 0;
}

template <class T, int W>
HPCCD_HD Lanes<T, W> square_root(Lanes<T, W> x) {
#if defined(__AVX512F__)
  if constexpr (sizeof(x.v) == 64 && sizeof(T) == 8)
    return Lanes<T, W>((typename Lanes<T, W>::Vec)_mm512_sqrt_pd((__m512d)x.v));
#endif
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
