// SPDX-License-Identifier: Apache-2.0
// Tests of many pairs of features in lanes: brings them in and takes the outcomes apart. Part of batch.inl and
// distance_batch.inl.

#include "elementary/lane_groups.inl"
#include "elementary/load.inl"

template <Kind kind, class R>
struct FeaturePairs {
  static constexpr int width = RealTraits<R>::width;
  HPCCD_HD static Motion<R> load(const Geometry& g, const std::uint32_t* first, const std::uint32_t* second) {
    return HPCCD_ISA::load<kind>(g, first, second, static_cast<R*>(nullptr));
  }
};

template <Kind kind, class R, class Function>
HPCCD_HD void for_lanes(const Geometry& g, const std::uint32_t* first, const std::uint32_t* second,
                        const std::uint32_t* where, std::uint32_t n, Function&& function) {
  for_groups<FeaturePairs<kind, R>>(g, first, second, where, n, function);
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
