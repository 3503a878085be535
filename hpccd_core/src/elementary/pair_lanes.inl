// SPDX-License-Identifier: Apache-2.0
// A test of many pairs in lanes: brings them in and takes the outcomes apart. Part of every batch.

#include "elementary/load.inl"

// The pairs at `where`, as many at a time as there are lanes; the last group is filled up with copies of the last pair.
template <Kind kind, class R, class Function>
HPCCD_HD void for_lanes(const Geometry& g, const std::uint32_t* first, const std::uint32_t* second,
                        const std::uint32_t* where, std::uint32_t n, Function&& function) {
  constexpr int W = RealTraits<R>::width;
  for (std::uint32_t i = 0; i < n; i += W) {
    std::uint32_t a[W], b[W], at[W];
    for (int lane = 0; lane < W; ++lane) {
      const std::uint32_t j = i + lane < n ? i + lane : n - 1;
      at[lane] = where ? where[j] : j;
      a[lane] = first[at[lane]];
      b[lane] = second[at[lane]];
    }
    const unsigned valid = n - i >= W ? (1u << W) - 1 : (1u << (n - i)) - 1;
    function(load<kind>(g, a, b, static_cast<R*>(nullptr)), at, valid);
  }
}

HPCCD_HD void append(std::uint32_t* list, std::uint32_t& n, const std::uint32_t* at, unsigned lanes) {
  for (; lanes; lanes &= lanes - 1) list[n++] = at[__builtin_ctz(lanes)];
}

template <class R>
HPCCD_HD void collect(const Outcome<R>& o, const std::uint32_t* at, unsigned valid, BatchResult& result) {
  using Scalar = typename RealTraits<R>::Scalar;
  const unsigned contact = bits(o.contact) & valid, none = bits(o.none) & valid;
  alignas(64) Scalar toc[RealTraits<R>::width], delta[RealTraits<R>::width];
  __builtin_memcpy(toc, &o.toc, sizeof toc);
  __builtin_memcpy(delta, &o.delta, sizeof delta);
  for (unsigned lanes = contact; lanes; lanes &= lanes - 1) {
    const int lane = __builtin_ctz(lanes);
    result.contact[result.n_contacts] = at[lane];
    result.toc[result.n_contacts] = toc[lane];
    result.delta[result.n_contacts++] = delta[lane];
  }
  append(result.undecided, result.n_undecided, at, valid & ~contact & ~none);
  result.counts.roots += static_cast<unsigned>(__builtin_popcount(none));
}
