// SPDX-License-Identifier: Apache-2.0
// Processes the pairs of a batch in groups of as many pairs as there are lanes. Part of distance_batch.inl and
// intersection_batch.inl.

// Processes the pairs at `where` (null: all); the last group is filled up with copies of the last pair. `function`
// receives what Pairs::load brings into lanes, the positions of the pairs, and a bit for each valid lane.
template <class Pairs, class Function>
HPCCD_HD void for_groups(const Geometry& g, const std::uint32_t* first, const std::uint32_t* second,
                         const std::uint32_t* where, std::uint32_t n, Function&& function) {
  constexpr int W = Pairs::width;
  for (std::uint32_t i = 0; i < n; i += W) {
    std::uint32_t a[W], b[W], at[W];
    for (int lane = 0; lane < W; ++lane) {
      const std::uint32_t j = i + lane < n ? i + lane : n - 1;
      at[lane] = where ? where[j] : j;
      a[lane] = first[at[lane]];
      b[lane] = second[at[lane]];
    }
    const unsigned valid = n - i >= W ? (1u << W) - 1 : (1u << (n - i)) - 1;
    function(Pairs::load(g, a, b), at, valid);
  }
}

HPCCD_HD void append(std::uint32_t* list, std::uint32_t& n, const std::uint32_t* at, unsigned lanes) {
  for (; lanes; lanes &= lanes - 1) list[n++] = at[__builtin_ctz(lanes)];
}
