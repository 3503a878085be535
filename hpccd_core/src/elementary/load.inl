// SPDX-License-Identifier: Apache-2.0
// Brings the vectors p, a, b of several pairs (motion.h) from rows of vertices into lanes. Part of batch.inl.
// Subtractions are done a row at a time (both ends of a motion at once), then rows are turned into lanes.

// x y z at t = 0 and at t = 1 of one of p, a, b in all lanes.
struct Columns {
  Vec3<Double> t0, t1;
};

#if defined(__AVX512F__)

using Row = __m512d;  // x y z . at t = 0, x y z . at t = 1
HPCCD_HD Row difference(const VertexRow& to, const VertexRow& from) {
  return _mm512_sub_pd(_mm512_load_pd(to.t0), _mm512_load_pd(from.t0));
}

HPCCD_HD Columns turn(const Row r[8]) {
  // Pairs of rows interleaved: 128-bit parts hold x, z of t0 and x, z of t1 (low), y and padding (high).
  Row low[4], high[4];
  for (int i = 0; i < 4; ++i) {
    low[i] = _mm512_unpacklo_pd(r[2 * i], r[2 * i + 1]);
    high[i] = _mm512_unpackhi_pd(r[2 * i], r[2 * i + 1]);
  }
  // 0x88 takes parts 0 and 2 of both, 0xDD parts 1 and 3.
  const Row x_a = _mm512_shuffle_f64x2(low[0], low[1], 0x88), x_b = _mm512_shuffle_f64x2(low[2], low[3], 0x88);
  const Row z_a = _mm512_shuffle_f64x2(low[0], low[1], 0xDD), z_b = _mm512_shuffle_f64x2(low[2], low[3], 0xDD);
  const Row y_a = _mm512_shuffle_f64x2(high[0], high[1], 0x88), y_b = _mm512_shuffle_f64x2(high[2], high[3], 0x88);
  const auto lanes = [](Row v) { return Double((Double::Vec)v); };
  return {{lanes(_mm512_shuffle_f64x2(x_a, x_b, 0x88)), lanes(_mm512_shuffle_f64x2(y_a, y_b, 0x88)),
           lanes(_mm512_shuffle_f64x2(z_a, z_b, 0x88))},
          {lanes(_mm512_shuffle_f64x2(x_a, x_b, 0xDD)), lanes(_mm512_shuffle_f64x2(y_a, y_b, 0xDD)),
           lanes(_mm512_shuffle_f64x2(z_a, z_b, 0xDD))}};
}

#elif defined(__AVX2__)

struct Row {
  __m256d t0, t1;
};
HPCCD_HD Row difference(const VertexRow& to, const VertexRow& from) {
  return {_mm256_sub_pd(_mm256_load_pd(to.t0), _mm256_load_pd(from.t0)),
          _mm256_sub_pd(_mm256_load_pd(to.t1), _mm256_load_pd(from.t1))};
}

HPCCD_HD Vec3<Double> turn_half(__m256d a, __m256d b, __m256d c, __m256d d) {
  const __m256d xz_ab = _mm256_unpacklo_pd(a, b), y_ab = _mm256_unpackhi_pd(a, b);
  const __m256d xz_cd = _mm256_unpacklo_pd(c, d), y_cd = _mm256_unpackhi_pd(c, d);
  const auto lanes = [](__m256d v) { return Double((Double::Vec)v); };
  return {lanes(_mm256_permute2f128_pd(xz_ab, xz_cd, 0x20)), lanes(_mm256_permute2f128_pd(y_ab, y_cd, 0x20)),
          lanes(_mm256_permute2f128_pd(xz_ab, xz_cd, 0x31))};
}

HPCCD_HD Columns turn(const Row r[4]) {
  return {turn_half(r[0].t0, r[1].t0, r[2].t0, r[3].t0), turn_half(r[0].t1, r[1].t1, r[2].t1, r[3].t1)};
}

#else

using Row = Columns;
HPCCD_HD Row difference(const VertexRow& to, const VertexRow& from) {
  static_assert(double_width == 1);
  return {{to.t0[0] - from.t0[0], to.t0[1] - from.t0[1], to.t0[2] - from.t0[2]},
          {to.t1[0] - from.t1[0], to.t1[1] - from.t1[1], to.t1[2] - from.t1[2]}};
}
HPCCD_HD Columns turn(const Row r[1]) { return r[0]; }

#endif

template <Kind kind>
HPCCD_HD Motion<Double> load(const Geometry& g, const std::uint32_t* first, const std::uint32_t* second, Double*) {
  using S = Spans<kind>;
  Row p[double_width], a[double_width], b[double_width];
  for (int lane = 0; lane < double_width; ++lane) {
    std::uint32_t v[4];
    pair_vertices<kind>(g, first[lane], second[lane], v);
    const auto span = [&](int to, int from) { return difference(g.vertices[v[to]], g.vertices[v[from]]); };
    p[lane] = span(S::p_to, S::p_from), a[lane] = span(S::a_to, S::a_from), b[lane] = span(S::b_to, S::b_from);
  }
  const Columns p_lanes = turn(p), a_lanes = turn(a), b_lanes = turn(b);
  return {p_lanes.t0, a_lanes.t0, b_lanes.t0, p_lanes.t1, a_lanes.t1, b_lanes.t1};
}

// In single precision: differences are taken in double precision and brought to about one by the scene's scale first.
HPCCD_HD Single narrowed(const Double* parts, double scale) {
  Single r;
#if defined(__AVX512F__)
  const __m512d s = _mm512_set1_pd(scale);
  const __m256 low = _mm512_cvtpd_ps(_mm512_mul_pd((__m512d)parts[0].v, s));
  const __m256 high = _mm512_cvtpd_ps(_mm512_mul_pd((__m512d)parts[1].v, s));
  r.v = (Single::Vec)_mm512_insertf32x8(_mm512_castps256_ps512(low), high, 1);
#elif defined(__AVX2__)
  const __m256d s = _mm256_set1_pd(scale);
  const __m128 low = _mm256_cvtpd_ps(_mm256_mul_pd((__m256d)parts[0].v, s));
  const __m128 high = _mm256_cvtpd_ps(_mm256_mul_pd((__m256d)parts[1].v, s));
  r.v = (Single::Vec)_mm256_insertf128_ps(_mm256_castps128_ps256(low), high, 1);
#else
  r = static_cast<float>(parts[0] * scale);
#endif
  return r;
}

template <Kind kind>
HPCCD_HD Motion<Single> load(const Geometry& g, const std::uint32_t* first, const std::uint32_t* second, Single*) {
  constexpr int n = RealTraits<Single>::width / double_width;
  Motion<Double> parts[n];
  for (int i = 0; i < n; ++i)
    parts[i] = load<kind>(g, first + i * double_width, second + i * double_width, static_cast<Double*>(nullptr));
  const auto vector = [&](Vec3<Double> Motion<Double>::* v) {
    Double x[n], y[n], z[n];
    for (int i = 0; i < n; ++i) x[i] = (parts[i].*v).x, y[i] = (parts[i].*v).y, z[i] = (parts[i].*v).z;
    return Vec3<Single>{narrowed(x, g.scale), narrowed(y, g.scale), narrowed(z, g.scale)};
  };
  using M = Motion<Double>;
  return {vector(&M::p0), vector(&M::a0), vector(&M::b0), vector(&M::p1), vector(&M::a1), vector(&M::b1)};
}
