// SPDX-License-Identifier: Apache-2.0
// The interface of kernels (scalar.h), implemented with AVX2.
#pragma once

#include <immintrin.h>

#include "base/simd/lanes.h"
#include "base/simd/numbers.h"
#include "base/vec3.h"

#define HPCCD_ISA avx2

namespace hpccd {

HPCCD_HD unsigned bits(LaneMask<double, 4> m) { return static_cast<unsigned>(_mm256_movemask_pd((__m256d)m.v)); }
HPCCD_HD unsigned bits(LaneMask<float, 8> m) { return static_cast<unsigned>(_mm256_movemask_ps((__m256)m.v)); }

}  // namespace hpccd

namespace hpccd::avx2 {

using Double = Lanes<double, 4>;
using Single = Lanes<float, 8>;
inline constexpr int double_width = 4;

struct MotionRow {
  __m256d t0, t1;
};
HPCCD_HD MotionRow difference(const double* to, const double* from) {
  return {_mm256_sub_pd(_mm256_load_pd(to), _mm256_load_pd(from)),
          _mm256_sub_pd(_mm256_load_pd(to + 4), _mm256_load_pd(from + 4))};
}

HPCCD_HD Vec3<Double> transposed(__m256d a, __m256d b, __m256d c, __m256d d) {
  const __m256d xz_ab = _mm256_unpacklo_pd(a, b), y_ab = _mm256_unpackhi_pd(a, b);
  const __m256d xz_cd = _mm256_unpacklo_pd(c, d), y_cd = _mm256_unpackhi_pd(c, d);
  const auto lanes = [](__m256d v) { return Double((Double::Vec)v); };
  return {lanes(_mm256_permute2f128_pd(xz_ab, xz_cd, 0x20)), lanes(_mm256_permute2f128_pd(y_ab, y_cd, 0x20)),
          lanes(_mm256_permute2f128_pd(xz_ab, xz_cd, 0x31))};
}

struct MotionLanes {
  Vec3<Double> t0, t1;
};
HPCCD_HD MotionLanes transposed(const MotionRow r[double_width]) {
  return {transposed(r[0].t0, r[1].t0, r[2].t0, r[3].t0), transposed(r[0].t1, r[1].t1, r[2].t1, r[3].t1)};
}

struct PointRows {
  __m256d row[double_width];
};
HPCCD_HD PointRows point_rows(const double* const at[double_width]) {
  return {{_mm256_load_pd(at[0]), _mm256_load_pd(at[1]), _mm256_load_pd(at[2]), _mm256_load_pd(at[3])}};
}
HPCCD_HD PointRows difference(const PointRows& to, const PointRows& from) {
  PointRows d;
  for (int i = 0; i < double_width; ++i) d.row[i] = _mm256_sub_pd(to.row[i], from.row[i]);
  return d;
}
HPCCD_HD Vec3<Double> transposed(const PointRows& r) { return transposed(r.row[0], r.row[1], r.row[2], r.row[3]); }

struct RoundedRows {
  __m256 row[8];
};
template <class Row>
HPCCD_HD RoundedRows rounded_rows(Row&& at) {
  RoundedRows r;
  for (int i = 0; i < 8; ++i) r.row[i] = _mm256_load_ps(at(i));
  return r;
}
HPCCD_HD RoundedRows difference(const RoundedRows& to, const RoundedRows& from) {
  RoundedRows d;
  for (int i = 0; i < 8; ++i) d.row[i] = _mm256_sub_ps(to.row[i], from.row[i]);
  return d;
}
struct RoundedLanes {
  Vec3<Single> t0, t1;
};
HPCCD_HD RoundedLanes transposed(const RoundedRows& r) {
  // For four rows: t0 in the low half, t1 in the high one.
  __m256 x[2], y[2], z[2];
  for (int i = 0; i < 2; ++i) {
    const __m256* p = r.row + 4 * i;
    const __m256d xy_a = _mm256_castps_pd(_mm256_unpacklo_ps(p[0], p[1])),
                  z_a = _mm256_castps_pd(_mm256_unpackhi_ps(p[0], p[1])),
                  xy_b = _mm256_castps_pd(_mm256_unpacklo_ps(p[2], p[3])),
                  z_b = _mm256_castps_pd(_mm256_unpackhi_ps(p[2], p[3]));
    x[i] = _mm256_castpd_ps(_mm256_unpacklo_pd(xy_a, xy_b));
    y[i] = _mm256_castpd_ps(_mm256_unpackhi_pd(xy_a, xy_b));
    z[i] = _mm256_castpd_ps(_mm256_unpacklo_pd(z_a, z_b));
  }
  const auto lanes = [](__m256 v) { return Single((Single::Vec)v); };
  return {{lanes(_mm256_permute2f128_ps(x[0], x[1], 0x20)), lanes(_mm256_permute2f128_ps(y[0], y[1], 0x20)),
           lanes(_mm256_permute2f128_ps(z[0], z[1], 0x20))},
          {lanes(_mm256_permute2f128_ps(x[0], x[1], 0x31)), lanes(_mm256_permute2f128_ps(y[0], y[1], 0x31)),
           lanes(_mm256_permute2f128_ps(z[0], z[1], 0x31))}};
}

struct Floats16 {
  __m256 half[2];
};
HPCCD_HD Floats16 load16(const float* x) { return {{_mm256_load_ps(x), _mm256_load_ps(x + 8)}}; }
HPCCD_HD Floats16 all16(float x) { return {{_mm256_set1_ps(x), _mm256_set1_ps(x)}}; }
HPCCD_HD Floats16 operator+(const Floats16& a, const Floats16& b) {
  return {{_mm256_add_ps(a.half[0], b.half[0]), _mm256_add_ps(a.half[1], b.half[1])}};
}
HPCCD_HD Floats16 operator-(const Floats16& a, const Floats16& b) {
  return {{_mm256_sub_ps(a.half[0], b.half[0]), _mm256_sub_ps(a.half[1], b.half[1])}};
}
HPCCD_HD Floats16 operator*(const Floats16& a, const Floats16& b) {
  return {{_mm256_mul_ps(a.half[0], b.half[0]), _mm256_mul_ps(a.half[1], b.half[1])}};
}
HPCCD_HD Floats16 first_half_twice(const Floats16& x) { return {{x.half[0], x.half[0]}}; }
HPCCD_HD Floats16 min(const Floats16& a, const Floats16& b) {
  return {{_mm256_min_ps(a.half[0], b.half[0]), _mm256_min_ps(a.half[1], b.half[1])}};
}
HPCCD_HD Floats16 max(const Floats16& a, const Floats16& b) {
  return {{_mm256_max_ps(a.half[0], b.half[0]), _mm256_max_ps(a.half[1], b.half[1])}};
}

struct Mask16 {
  __m256 half[2] = {};
  HPCCD_HD unsigned bits() const {
    return static_cast<unsigned>(_mm256_movemask_ps(half[0])) | static_cast<unsigned>(_mm256_movemask_ps(half[1])) << 8;
  }
};
HPCCD_HD Mask16 operator&(const Mask16& a, const Mask16& b) {
  return {{_mm256_and_ps(a.half[0], b.half[0]), _mm256_and_ps(a.half[1], b.half[1])}};
}
HPCCD_HD Mask16 operator|(const Mask16& a, const Mask16& b) {
  return {{_mm256_or_ps(a.half[0], b.half[0]), _mm256_or_ps(a.half[1], b.half[1])}};
}
HPCCD_HD Mask16 less(const Floats16& a, const Floats16& b) {
  return {{_mm256_cmp_ps(a.half[0], b.half[0], _CMP_LT_OQ), _mm256_cmp_ps(a.half[1], b.half[1], _CMP_LT_OQ)}};
}
HPCCD_HD bool any_in_both_halves(const Mask16& a, const Mask16& b) {
  const __m256 in_a = _mm256_and_ps(a.half[0], a.half[1]), in_b = _mm256_and_ps(b.half[0], b.half[1]);
  return _mm256_movemask_ps(_mm256_or_ps(in_a, in_b)) != 0;
}

struct Row {
  __m256 v;
};
struct RowMask {
  __m256 v;
};
inline constexpr std::uint32_t row_width = 8;
HPCCD_HD Row load_row(const float* x) { return {_mm256_load_ps(x)}; }
HPCCD_HD Row all_lanes(float x) { return {_mm256_set1_ps(x)}; }
HPCCD_HD void store(float* out, Row x) { _mm256_store_ps(out, x.v); }
HPCCD_HD Row operator+(Row a, Row b) { return {_mm256_add_ps(a.v, b.v)}; }
HPCCD_HD Row operator-(Row a, Row b) { return {_mm256_sub_ps(a.v, b.v)}; }
HPCCD_HD Row operator*(Row a, Row b) { return {_mm256_mul_ps(a.v, b.v)}; }
HPCCD_HD RowMask less(Row a, Row b) { return {_mm256_cmp_ps(a.v, b.v, _CMP_LT_OQ)}; }
HPCCD_HD RowMask operator&(RowMask a, RowMask b) { return {_mm256_and_ps(a.v, b.v)}; }

struct SideBits {
  __m256i v;
};
HPCCD_HD SideBits side_bits(const RowMask m[6]) {
  __m256i all = _mm256_setzero_si256();
  for (int i = 0; i < 6; ++i)
    all = _mm256_or_si256(all, _mm256_and_si256(_mm256_castps_si256(m[i].v), _mm256_set1_epi32(1 << i)));
  return {all};
}

template <std::uint32_t n>
struct Rows16 {
  const float (*rows)[16];
  HPCCD_HD Floats16 operator[](std::uint32_t i) const { return load16(rows[i]); }
};
template <std::uint32_t n>
HPCCD_HD Rows16<n> load_rows(const float (&rows)[n][16]) {
  return {rows};
}

struct Bytes16 {
  __m128i v;
};
HPCCD_HD Bytes16 load_bytes(const std::uint8_t* x) { return {_mm_load_si128(reinterpret_cast<const __m128i*>(x))}; }
HPCCD_HD Bytes16 operator&(Bytes16 a, Bytes16 b) { return {_mm_and_si128(a.v, b.v)}; }
HPCCD_HD Bytes16 operator|(Bytes16 a, Bytes16 b) { return {_mm_or_si128(a.v, b.v)}; }
HPCCD_HD Bytes16 to_bytes(const SideBits (&of)[2]) {
  // Quarters of four numbers each: 0 2 1 3.
  const __m256i words = _mm256_permute4x64_epi64(_mm256_packs_epi32(of[0].v, of[1].v), 0xD8);
  return {_mm_packus_epi16(_mm256_castsi256_si128(words), _mm256_extracti128_si256(words, 1))};
}
HPCCD_HD Bytes16 picked(Bytes16 bytes, Bytes16 which) { return {_mm_shuffle_epi8(bytes.v, which.v)}; }
HPCCD_HD Bytes16 picked(Bytes16 bytes, Bytes16 next, Bytes16 which) {
  return {_mm_blendv_epi8(_mm_shuffle_epi8(bytes.v, which.v), _mm_shuffle_epi8(next.v, which.v),
                          _mm_slli_epi16(which.v, 3))};
}
HPCCD_HD unsigned zeros(Bytes16 x) {
  return static_cast<unsigned>(_mm_movemask_epi8(_mm_cmpeq_epi8(x.v, _mm_setzero_si128())));
}

HPCCD_HD unsigned equal16(const std::uint32_t* numbers, std::uint32_t x) {
  unsigned bits = 0;
  for (int half = 0; half < 2; ++half) {
    const auto v = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(numbers + 8 * half));
    const auto e = _mm256_cmpeq_epi32(v, _mm256_set1_epi32(static_cast<int>(x)));
    bits |= static_cast<unsigned>(_mm256_movemask_ps(_mm256_castsi256_ps(e))) << (8 * half);
  }
  return bits;
}

using Numbers16 = NumbersInMemory;
HPCCD_HD Numbers16 load_numbers(const std::uint32_t* numbers) { return {numbers}; }

}  // namespace hpccd::avx2
