// SPDX-License-Identifier: Apache-2.0
// The remaining pairs of a batch, with the vertices of their features, which are looked up once for all filters. Part
// of kdop_filter.inl.

inline constexpr std::uint32_t most_lanes = 16;  // copies of the last pair that follow it, to fill up lanes

struct PairList {
  std::uint32_t n = 0;
  std::uint32_t at[batch_capacity + most_lanes];  // in the batch
  std::uint32_t vertices[batch_capacity + most_lanes][4];

  // The first n elements of `at` are valid.
  template <Kind kind>
  HPCCD_HD void find_vertices(const Geometry& g, const std::uint32_t* first, const std::uint32_t* second) {
    const std::uint32_t filled = (n + most_lanes - 1) / most_lanes * most_lanes;
    for (std::uint32_t j = n; j < filled; ++j) at[j] = at[n - 1];
    for (std::uint32_t j = 0; j < filled; ++j) pair_vertices<kind>(g, first[at[j]], second[at[j]], vertices[j]);
  }
};

// Selected pairs of a list, by number.
struct Chosen {
  std::uint32_t n = 0;
  std::uint32_t of[batch_capacity + most_lanes];
  HPCCD_HD std::uint32_t operator[](std::uint32_t i) const { return of[i]; }
  HPCCD_HD void fill_up() {
    for (std::uint32_t j = 0; n > 0 && j < most_lanes; ++j) of[n + j] = of[n - 1];
  }
};
struct All {
  std::uint32_t n;
  HPCCD_HD std::uint32_t operator[](std::uint32_t i) const { return i; }
  HPCCD_HD void fill_up() {}
};

template <Kind kind>
HPCCD_HD void list_all(const Geometry& g, const std::uint32_t* first, const std::uint32_t* second, std::uint32_t n,
                       PairList& list) {
  for (std::uint32_t i = 0; i < n; ++i) list.at[i] = i;
  list.n = n;
  list.find_vertices<kind>(g, first, second);
}
