// SPDX-License-Identifier: Apache-2.0
// Leaves out the pairs that are apart along a direction of slabs.h. Part of batch.inl.

// Lowest and highest places of some vertices at both ends of their motion.
#if defined(__AVX512F__)

struct Slabs {
  __m512 low, high;  // at t = 0, then at t = 1
};
HPCCD_HD Slabs slabs_at(const SlabRow* rows, std::uint32_t v) {
  const __m512 row = _mm512_load_ps(rows[v].t0);
  return {row, row};
}
HPCCD_HD Slabs both(Slabs a, Slabs b) { return {_mm512_min_ps(a.low, b.low), _mm512_max_ps(a.high, b.high)}; }
HPCCD_HD bool are_apart(Slabs a, Slabs b) {
  const unsigned below = _mm512_cmp_ps_mask(a.high, b.low, _CMP_LT_OQ);
  const unsigned above = _mm512_cmp_ps_mask(b.high, a.low, _CMP_LT_OQ);
  return ((below & below >> n_slabs) | (above & above >> n_slabs)) != 0;
}

#elif defined(__AVX2__)

struct Slabs {
  __m256 low[2], high[2];  // at t = 0, at t = 1
};
HPCCD_HD Slabs slabs_at(const SlabRow* rows, std::uint32_t v) {
  const __m256 t0 = _mm256_load_ps(rows[v].t0), t1 = _mm256_load_ps(rows[v].t1);
  return {{t0, t1}, {t0, t1}};
}
HPCCD_HD Slabs both(Slabs a, Slabs b) {
  return {{_mm256_min_ps(a.low[0], b.low[0]), _mm256_min_ps(a.low[1], b.low[1])},
          {_mm256_max_ps(a.high[0], b.high[0]), _mm256_max_ps(a.high[1], b.high[1])}};
}
HPCCD_HD __m256 in_order(Slabs a, Slabs b) {
  return _mm256_and_ps(_mm256_cmp_ps(a.high[0], b.low[0], _CMP_LT_OQ), _mm256_cmp_ps(a.high[1], b.low[1], _CMP_LT_OQ));
}
HPCCD_HD bool are_apart(Slabs a, Slabs b) {
  return _mm256_movemask_ps(_mm256_or_ps(in_order(a, b), in_order(b, a))) != 0;
}

#else

struct Slabs {
  SlabRow low, high;
};
HPCCD_HD Slabs slabs_at(const SlabRow* rows, std::uint32_t v) { return {rows[v], rows[v]}; }
HPCCD_HD Slabs both(const Slabs& a, const Slabs& b) {
  Slabs c;
  for (int k = 0; k < n_slabs; ++k) {
    c.low.t0[k] = lesser(a.low.t0[k], b.low.t0[k]), c.high.t0[k] = greater(a.high.t0[k], b.high.t0[k]);
    c.low.t1[k] = lesser(a.low.t1[k], b.low.t1[k]), c.high.t1[k] = greater(a.high.t1[k], b.high.t1[k]);
  }
  return c;
}
HPCCD_HD bool are_apart(const Slabs& a, const Slabs& b) {
  bool apart = false;
  for (int k = 0; k < n_slabs; ++k)
    apart |= ((a.high.t0[k] < b.low.t0[k]) & (a.high.t1[k] < b.low.t1[k])) |
             ((b.high.t0[k] < a.low.t0[k]) & (b.high.t1[k] < a.low.t1[k]));
  return apart;
}

#endif

// Positions of the pairs that are not apart, in `near`; how many there are.
template <Kind kind>
HPCCD_HD std::uint32_t near_pairs(const Geometry& g, const std::uint32_t* first, const std::uint32_t* second,
                                  std::uint32_t n, std::uint32_t* near) {
  std::uint32_t count = 0;
  for (std::uint32_t i = 0; i < n; ++i) {
    std::uint32_t v[4];
    pair_vertices<kind>(g, first[i], second[i], v);
    const auto at = [&](int k) { return slabs_at(g.slabs, v[k]); };
    near[count] = i;  // kept only if counted
    if constexpr (kind == Kind::vertex_face)
      count += !are_apart(at(0), both(at(1), both(at(2), at(3))));
    else
      count += !are_apart(both(at(0), at(1)), both(at(2), at(3)));
  }
  return count;
}
