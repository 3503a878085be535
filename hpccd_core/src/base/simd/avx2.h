// SPDX-License-Identifier: Apache-2.0
// What kernels are written against (scalar.h), with AVX2.
#pragma once

#include <immintrin.h>

#include "base/simd/lanes.h"
#include "base/simd/one_by_one.h"
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

HPCCD_HD Single narrowed(const Double* parts, double scale) {
  const __m256d s = _mm256_set1_pd(scale);
  const __m128 low = _mm256_cvtpd_ps(_mm256_mul_pd((__m256d)parts[0].v, s));
  const __m128 high = _mm256_cvtpd_ps(_mm256_mul_pd((__m256d)parts[1].v, s));
  return Single((Single::Vec)_mm256_insertf128_ps(_mm256_castps128_ps256(low), high, 1));
}

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

template <std::uint32_t n>
struct Rows16 {
  const float (*rows)[16];
  HPCCD_HD Floats16 operator[](std::uint32_t i) const { return load16(rows[i]); }
};
template <std::uint32_t n>
HPCCD_HD Rows16<n> load_rows(const float (&rows)[n][16]) {
  return {rows};
}

struct Picks16 {
  __m256i half[2];
};
HPCCD_HD Picks16 picks(const std::uint8_t* which) {
  const __m128i all = _mm_load_si128(reinterpret_cast<const __m128i*>(which));
  return {{_mm256_cvtepu8_epi32(all), _mm256_cvtepu8_epi32(_mm_srli_si128(all, 8))}};
}
// Bit `bit` of each pick decides between two.
template <int bit>
HPCCD_HD __m256 by_bit(__m256i pick, __m256 zero, __m256 one) {
  return _mm256_blendv_ps(zero, one, _mm256_castsi256_ps(_mm256_slli_epi32(pick, 31 - bit)));
}
HPCCD_HD __m256 of_row(__m256 low, __m256 high, __m256i pick) {
  return by_bit<3>(pick, _mm256_permutevar8x32_ps(low, pick), _mm256_permutevar8x32_ps(high, pick));
}
HPCCD_HD Floats16 picked(const float* row, const Picks16& p) {
  const __m256 low = _mm256_load_ps(row), high = _mm256_load_ps(row + 8);
  return {{of_row(low, high, p.half[0]), of_row(low, high, p.half[1])}};
}
HPCCD_HD Floats16 picked(const float* row, const float* next, const Picks16& p) {
  const Floats16 a = picked(row, p), b = picked(next, p);
  return {{by_bit<4>(p.half[0], a.half[0], b.half[0]), by_bit<4>(p.half[1], a.half[1], b.half[1])}};
}
HPCCD_HD void store16(float* out, const Floats16& x) {
  _mm256_store_ps(out, x.half[0]);
  _mm256_store_ps(out + 8, x.half[1]);
}
HPCCD_HD void pick(std::uint32_t* out, const std::uint32_t* numbers, const Picks16& p) {
  const auto part = [&](int i) { return _mm256_castsi256_ps(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(numbers + 8 * i))); };
  for (int half = 0; half < 2; ++half) {
    const __m256i which = p.half[half];
    const __m256 x = by_bit<4>(which, of_row(part(0), part(1), which), of_row(part(2), part(3), which));
    _mm256_store_ps(reinterpret_cast<float*>(out + 8 * half), x);
  }
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

template <bool ascending>
HPCCD_HD void append_pairs(std::uint32_t* first, std::uint32_t* second, std::uint32_t& n, std::uint32_t number,
                           const std::uint32_t* others, unsigned lanes) {
  append_one_by_one<ascending>(first, second, n, number, others, lanes);
}

}  // namespace hpccd::avx2
