// SPDX-License-Identifier: Apache-2.0
// Runs tests of many pairs of features in lanes: loads the pairs and distributes the results. Part of batch.inl and
// distance_batch.inl.

#include "elementary/load.inl"

// A group of pairs of a list, from number `begin` of the chosen ones on, with a bit for each valid lane.
template <class Numbers>
struct LaneNumbers {
  const Numbers& numbers;
  std::uint32_t begin;
  unsigned valid;
  HPCCD_HD std::uint32_t operator[](int lane) const { return numbers[begin + static_cast<std::uint32_t>(lane)]; }
};

// Loads pairs into lanes and passes them to `function`, as many at a time as there are lanes.
template <Kind kind, class R, class Numbers, class Function>
HPCCD_HD void for_lanes(const Geometry& g, const PairList& list, Numbers& chosen, Function&& function) {
  constexpr std::uint32_t W = RealTraits<R>::width;
  static_assert(W <= most_lanes);
  chosen.fill_up();
  for (std::uint32_t i = 0; i < chosen.n; i += W) {
    const std::uint32_t* v[W];
    for (std::uint32_t lane = 0; lane < W; ++lane) v[lane] = list.vertices[chosen[i + lane]];
    const unsigned valid = chosen.n - i >= W ? (1u << W) - 1 : (1u << (chosen.n - i)) - 1;
    function(load<kind>(g, v, static_cast<R*>(nullptr)), LaneNumbers<Numbers>{chosen, i, valid});
  }
}

template <class Numbers>
HPCCD_HD void append(Chosen& out, const LaneNumbers<Numbers>& of, unsigned lanes) {
  for (; lanes; lanes &= lanes - 1) out.of[out.n++] = of[__builtin_ctz(lanes)];
}
HPCCD_HD void append(Chosen& out, const Chosen& more) {
  __builtin_memcpy(out.of + out.n, more.of, more.n * sizeof *more.of);
  out.n += more.n;
}

template <class Numbers, class R>
HPCCD_HD void collect(const Outcome<R>& o, const PairList& list, const LaneNumbers<Numbers>& of, Chosen& undecided,
                      BatchResult& result) {
  using Scalar = typename RealTraits<R>::Scalar;
  const unsigned contact = bits(o.contact) & of.valid, none = bits(o.none) & of.valid;
  alignas(64) Scalar toc[RealTraits<R>::width], delta[RealTraits<R>::width];
  __builtin_memcpy(toc, &o.toc, sizeof toc);
  __builtin_memcpy(delta, &o.delta, sizeof delta);
  for (unsigned lanes = contact; lanes; lanes &= lanes - 1) {
    const int lane = __builtin_ctz(lanes);
    result.contact[result.n_contacts] = list.at[of[lane]];
    result.toc[result.n_contacts] = toc[lane];
    result.delta[result.n_contacts++] = delta[lane];
  }
  append(undecided, of, of.valid & ~contact & ~none);
  result.counts.roots += static_cast<unsigned>(__builtin_popcount(none));
}

HPCCD_HD void report_undecided(const PairList& list, const Chosen& undecided, BatchResult& result) {
  for (std::uint32_t i = 0; i < undecided.n; ++i) {
    result.undecided[i] = list.at[undecided.of[i]];
    result.apart_until[i] = 0;
  }
  result.n_undecided = undecided.n;
  result.counts.contacts += result.n_contacts;
  result.counts.undecided += result.n_undecided;
}
