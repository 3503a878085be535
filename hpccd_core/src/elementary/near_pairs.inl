// SPDX-License-Identifier: Apache-2.0
// Leaves out the pairs that are apart along a direction of slabs.h. Part of batch.inl.

#if defined(__AVX512F__)

struct Slabs {
  __m512 row;
};
HPCCD_HD Slabs slabs_at(const SlabRow* rows, std::uint32_t v) { return {_mm512_load_ps(rows[v].low)}; }
HPCCD_HD Slabs both(Slabs a, Slabs b) { return {_mm512_min_ps(a.row, b.row)}; }
HPCCD_HD bool are_apart(Slabs a, Slabs b) {
  const __m512 gap = _mm512_add_ps(a.row, _mm512_shuffle_f32x4(b.row, b.row, 0x4E));  // halves swapped
  return _mm512_cmp_ps_mask(gap, _mm512_setzero_ps(), _CMP_GT_OQ) != 0;
}

#elif defined(__AVX2__)

struct Slabs {
  __m256 low, minus_high;
};
HPCCD_HD Slabs slabs_at(const SlabRow* rows, std::uint32_t v) {
  return {_mm256_load_ps(rows[v].low), _mm256_load_ps(rows[v].minus_high)};
}
HPCCD_HD Slabs both(Slabs a, Slabs b) {
  return {_mm256_min_ps(a.low, b.low), _mm256_min_ps(a.minus_high, b.minus_high)};
}
HPCCD_HD bool are_apart(Slabs a, Slabs b) {
  const __m256 gap = _mm256_max_ps(_mm256_add_ps(a.low, b.minus_high), _mm256_add_ps(b.low, a.minus_high));
  return _mm256_movemask_ps(_mm256_cmp_ps(gap, _mm256_setzero_ps(), _CMP_GT_OQ)) != 0;
}

#else

using Slabs = SlabRow;
HPCCD_HD Slabs slabs_at(const SlabRow* rows, std::uint32_t v) { return rows[v]; }
HPCCD_HD Slabs both(const Slabs& a, const Slabs& b) {
  Slabs c;
  for (int k = 0; k < n_slabs; ++k) {
    c.low[k] = lesser(a.low[k], b.low[k]);
    c.minus_high[k] = lesser(a.minus_high[k], b.minus_high[k]);
  }
  return c;
}
HPCCD_HD bool are_apart(const Slabs& a, const Slabs& b) {
  bool apart = false;
  for (int k = 0; k < n_slabs; ++k) apart |= (a.low[k] + b.minus_high[k] > 0) | (b.low[k] + a.minus_high[k] > 0);
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
    vertex_indices<kind>(g, first[i], second[i], v);
    const auto at = [&](int k) { return slabs_at(g.slabs, v[k]); };
    near[count] = i;  // kept only if counted
    if constexpr (kind == Kind::vertex_face)
      count += !are_apart(at(0), both(at(1), both(at(2), at(3))));
    else
      count += !are_apart(both(at(0), at(1)), both(at(2), at(3)));
  }
  return count;
}
