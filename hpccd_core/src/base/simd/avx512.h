// SPDX-License-Identifier: Apache-2.0
// The interface of kernels (scalar.h), implemented with AVX-512 F, DQ, BW and VL.
#pragma once

#include <immintrin.h>

#include "base/simd/lanes.h"
#include "base/vec3.h"

#define HPCCD_ISA avx512

namespace hpccd {

HPCCD_HD unsigned bits(LaneMask<double, 8> m) { return _mm512_movepi64_mask((__m512i)m.v); }
HPCCD_HD unsigned bits(LaneMask<float, 16> m) { return _mm512_movepi32_mask((__m512i)m.v); }
HPCCD_HD Lanes<double, 8> square_root(Lanes<double, 8> x) {
  return Lanes<double, 8>((Lanes<double, 8>::Vec)_mm512_sqrt_pd((__m512d)x.v));
}

}  // namespace hpccd

namespace hpccd::avx512 {

using Double = Lanes<double, 8>;
using Single = Lanes<float, 16>;
inline constexpr int double_width = 8;

struct MotionRow {
  __m512d v;
};
HPCCD_HD MotionRow difference(const double* to, const double* from) {
  return {_mm512_sub_pd(_mm512_load_pd(to), _mm512_load_pd(from))};
}

struct MotionLanes {
  Vec3<Double> t0, t1;
};
HPCCD_HD MotionLanes transposed(const MotionRow r[double_width]) {
  // Pairs of rows interleaved: 128-bit parts hold x, z of t0 and x, z of t1 (low), y and padding (high).
  __m512d low[4], high[4];
  for (int i = 0; i < 4; ++i) {
    low[i] = _mm512_unpacklo_pd(r[2 * i].v, r[2 * i + 1].v);
    high[i] = _mm512_unpackhi_pd(r[2 * i].v, r[2 * i + 1].v);
  }
  // 0x88 takes parts 0 and 2 of both, 0xDD parts 1 and 3.
  const __m512d x_a = _mm512_shuffle_f64x2(low[0], low[1], 0x88), x_b = _mm512_shuffle_f64x2(low[2], low[3], 0x88);
  const __m512d z_a = _mm512_shuffle_f64x2(low[0], low[1], 0xDD), z_b = _mm512_shuffle_f64x2(low[2], low[3], 0xDD);
  const __m512d y_a = _mm512_shuffle_f64x2(high[0], high[1], 0x88), y_b = _mm512_shuffle_f64x2(high[2], high[3], 0x88);
  const auto lanes = [](__m512d v) { return Double((Double::Vec)v); };
  return {{lanes(_mm512_shuffle_f64x2(x_a, x_b, 0x88)), lanes(_mm512_shuffle_f64x2(y_a, y_b, 0x88)),
           lanes(_mm512_shuffle_f64x2(z_a, z_b, 0x88))},
          {lanes(_mm512_shuffle_f64x2(x_a, x_b, 0xDD)), lanes(_mm512_shuffle_f64x2(y_a, y_b, 0xDD)),
           lanes(_mm512_shuffle_f64x2(z_a, z_b, 0xDD))}};
}

// Rows 0 and 2, 1 and 3, 4 and 6, 5 and 7: so that the lanes of transposed rows come in order.
struct PointRows {
  __m512d pair[4];
};
HPCCD_HD PointRows point_rows(const double* const at[double_width]) {
  PointRows r;
  for (int i = 0; i < 4; ++i) {
    const int row = 4 * (i / 2) + i % 2;
    r.pair[i] = _mm512_insertf64x4(_mm512_castpd256_pd512(_mm256_load_pd(at[row])), _mm256_load_pd(at[row + 2]), 1);
  }
  return r;
}
HPCCD_HD PointRows difference(const PointRows& to, const PointRows& from) {
  PointRows d;
  for (int i = 0; i < 4; ++i) d.pair[i] = _mm512_sub_pd(to.pair[i], from.pair[i]);
  return d;
}
HPCCD_HD Vec3<Double> transposed(const PointRows& r) {
  const __m512d xz_a = _mm512_unpacklo_pd(r.pair[0], r.pair[1]), y_a = _mm512_unpackhi_pd(r.pair[0], r.pair[1]);
  const __m512d xz_b = _mm512_unpacklo_pd(r.pair[2], r.pair[3]), y_b = _mm512_unpackhi_pd(r.pair[2], r.pair[3]);
  const auto lanes = [](__m512d v) { return Double((Double::Vec)v); };
  return {lanes(_mm512_shuffle_f64x2(xz_a, xz_b, 0x88)), lanes(_mm512_shuffle_f64x2(y_a, y_b, 0x88)),
          lanes(_mm512_shuffle_f64x2(xz_a, xz_b, 0xDD))};
}

// Rows of eight floats, x y z and padding at both ends: rows 0 and 4, 1 and 5, up to 11 and 15.
struct RoundedRows {
  __m512 pair[8];
};
template <class Row>
HPCCD_HD RoundedRows rounded_rows(Row&& at) {
  RoundedRows r;
  for (int i = 0; i < 8; ++i) {
    const int row = 8 * (i / 4) + i % 4;
    r.pair[i] = _mm512_insertf32x8(_mm512_castps256_ps512(_mm256_load_ps(at(row))), _mm256_load_ps(at(row + 4)), 1);
  }
  return r;
}
HPCCD_HD RoundedRows difference(const RoundedRows& to, const RoundedRows& from) {
  RoundedRows d;
  for (int i = 0; i < 8; ++i) d.pair[i] = _mm512_sub_ps(to.pair[i], from.pair[i]);
  return d;
}
struct RoundedLanes {
  Vec3<Single> t0, t1;
};
HPCCD_HD RoundedLanes transposed(const RoundedRows& r) {
  // For rows i to i + 3 in turn: x, y and z of four, at t0 and at t1, and the same for the four rows behind them.
  __m512 x[2], y[2], z[2];
  for (int i = 0; i < 2; ++i) {
    const __m512* p = r.pair + 4 * i;
    const __m512d xy_a = _mm512_castps_pd(_mm512_unpacklo_ps(p[0], p[1])),
                  z_a = _mm512_castps_pd(_mm512_unpackhi_ps(p[0], p[1])),
                  xy_b = _mm512_castps_pd(_mm512_unpacklo_ps(p[2], p[3])),
                  z_b = _mm512_castps_pd(_mm512_unpackhi_ps(p[2], p[3]));
    x[i] = _mm512_castpd_ps(_mm512_unpacklo_pd(xy_a, xy_b));
    y[i] = _mm512_castpd_ps(_mm512_unpackhi_pd(xy_a, xy_b));
    z[i] = _mm512_castpd_ps(_mm512_unpacklo_pd(z_a, z_b));
  }
  const auto lanes = [](__m512 v) { return Single((Single::Vec)v); };
  return {{lanes(_mm512_shuffle_f32x4(x[0], x[1], 0x88)), lanes(_mm512_shuffle_f32x4(y[0], y[1], 0x88)),
           lanes(_mm512_shuffle_f32x4(z[0], z[1], 0x88))},
          {lanes(_mm512_shuffle_f32x4(x[0], x[1], 0xDD)), lanes(_mm512_shuffle_f32x4(y[0], y[1], 0xDD)),
           lanes(_mm512_shuffle_f32x4(z[0], z[1], 0xDD))}};
}

struct Floats16 {
  __m512 v;
};
HPCCD_HD Floats16 load16(const float* x) { return {_mm512_load_ps(x)}; }
HPCCD_HD Floats16 all16(float x) { return {_mm512_set1_ps(x)}; }
HPCCD_HD Floats16 operator+(Floats16 a, Floats16 b) { return {_mm512_add_ps(a.v, b.v)}; }
HPCCD_HD Floats16 operator-(Floats16 a, Floats16 b) { return {_mm512_sub_ps(a.v, b.v)}; }
HPCCD_HD Floats16 operator*(Floats16 a, Floats16 b) { return {_mm512_mul_ps(a.v, b.v)}; }
HPCCD_HD Floats16 first_half_twice(Floats16 x) { return {_mm512_broadcast_f32x8(_mm512_castps512_ps256(x.v))}; }
HPCCD_HD Floats16 min(Floats16 a, Floats16 b) { return {_mm512_min_ps(a.v, b.v)}; }
HPCCD_HD Floats16 max(Floats16 a, Floats16 b) { return {_mm512_max_ps(a.v, b.v)}; }

struct Mask16 {
  __mmask16 m = 0;
  HPCCD_HD unsigned bits() const { return m; }
};
HPCCD_HD Mask16 operator&(Mask16 a, Mask16 b) { return {static_cast<__mmask16>(a.m & b.m)}; }
HPCCD_HD Mask16 operator|(Mask16 a, Mask16 b) { return {_kor_mask16(a.m, b.m)}; }
HPCCD_HD Mask16 less(Floats16 a, Floats16 b) { return {_mm512_cmp_ps_mask(a.v, b.v, _CMP_LT_OQ)}; }
HPCCD_HD bool any_in_both_halves(Mask16 a, Mask16 b) {
  const unsigned in_a = a.m, in_b = b.m;
  return ((in_a & in_a >> 8) | (in_b & in_b >> 8)) != 0;
}

// As many floats as a register holds, and the result of comparing six pairs of them.
using Row = Floats16;
using RowMask = Mask16;
inline constexpr std::uint32_t row_width = 16;
HPCCD_HD Row load_row(const float* x) { return load16(x); }
HPCCD_HD Row all_lanes(float x) { return all16(x); }
HPCCD_HD void store(float* out, Row x) { _mm512_store_ps(out, x.v); }
struct SideBits {
  __m128i v;
};
HPCCD_HD SideBits side_bits(const RowMask m[6]) {
  __m128i all = _mm_maskz_set1_epi8(m[0].m, 1);
  for (int i = 1; i < 6; ++i) all = _mm_mask_add_epi8(all, m[i].m, all, _mm_set1_epi8(static_cast<char>(1 << i)));
  return {all};
}

template <std::uint32_t n>
struct Rows16 {
  Floats16 rows[n];
  HPCCD_HD Floats16 operator[](std::uint32_t i) const { return rows[i]; }
};
template <std::uint32_t n>
HPCCD_HD Rows16<n> load_rows(const float (&rows)[n][16]) {
  Rows16<n> r;
  for (std::uint32_t i = 0; i < n; ++i) r.rows[i] = load16(rows[i]);
  return r;
}

// Sixteen bytes.
struct Bytes16 {
  __m128i v;
};
HPCCD_HD Bytes16 load_bytes(const std::uint8_t* x) { return {_mm_load_si128(reinterpret_cast<const __m128i*>(x))}; }
HPCCD_HD Bytes16 operator&(Bytes16 a, Bytes16 b) { return {_mm_and_si128(a.v, b.v)}; }
HPCCD_HD Bytes16 operator|(Bytes16 a, Bytes16 b) { return {_mm_or_si128(a.v, b.v)}; }
// Bit i of byte j: lane j of mask i.
HPCCD_HD Bytes16 to_bytes(const SideBits (&of)[1]) { return {of[0].v}; }
// Byte j: byte number which[j], out of 16 or of 32.
HPCCD_HD Bytes16 picked(Bytes16 bytes, Bytes16 which) { return {_mm_shuffle_epi8(bytes.v, which.v)}; }
HPCCD_HD Bytes16 picked(Bytes16 bytes, Bytes16 next, Bytes16 which) {
  return {_mm_mask_shuffle_epi8(_mm_shuffle_epi8(bytes.v, which.v), _mm_test_epi8_mask(which.v, _mm_set1_epi8(16)),
                                next.v, which.v)};
}
HPCCD_HD unsigned zeros(Bytes16 x) { return _mm_testn_epi8_mask(x.v, x.v); }

HPCCD_HD unsigned equal16(const std::uint32_t* numbers, std::uint32_t x) {
  return _mm512_cmpeq_epi32_mask(_mm512_loadu_si512(numbers), _mm512_set1_epi32(static_cast<int>(x)));
}

struct Numbers16 {
  __m512i v;
};
HPCCD_HD Numbers16 load_numbers(const std::uint32_t* numbers) { return {_mm512_loadu_si512(numbers)}; }
HPCCD_HD void append_pairs(std::uint32_t* first, std::uint32_t* second, std::uint32_t& n, std::uint32_t number,
                           const Numbers16& others, unsigned lanes) {
  const __m512i of_lanes = _mm512_maskz_compress_epi32(static_cast<__mmask16>(lanes), others.v);
  const __m256i x = _mm256_set1_epi32(static_cast<int>(number));
  const auto put = [&](std::uint32_t at, __m256i y) {
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(first + at), x);
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(second + at), y);
  };
  const auto count = static_cast<unsigned>(__builtin_popcount(lanes));
  put(n, _mm512_castsi512_si256(of_lanes));
  if (count > 8) put(n + 8, _mm512_extracti64x4_epi64(of_lanes, 1));  // rarely: three is the mean
  n += count;
}

}  // namespace hpccd::avx512
