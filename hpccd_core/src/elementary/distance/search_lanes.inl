// SPDX-License-Identifier: Apache-2.0
// Searches for the earliest time within a separation, for many pairs in lanes. A pair takes 2 to 33 steps (6.6 on
// average for a ball that spins under a cloth), and the slowest of eight 11.2. When few pairs of a group are still
// running, they are set aside and later continued together with those of other groups. Part of distance_batch.inl.

// SeparationsOf: separations of lanes by their numbers in the list.
template <Kind kind, class SeparationsOf>
class SearchLanes {
 public:
  HPCCD_HD SearchLanes(const Geometry& g, const PairList& list, const SeparationsOf& separations_of,
                       BatchResult& result)
      : g_(g), list_(list), separations_of_(separations_of), result_(result) {}

  // Starts the searches of the valid lanes from a state before which the features are farther apart than d.
  template <class Numbers>
  HPCCD_HD void begin(const Motion<Double>& m, Double d, const Look<kind, Double>& start,
                      const LaneNumbers<Numbers>& of) {
    if (!of.valid) return;
    const std::uint32_t taken[width] = {};
    run(m, SeparationSearch<kind, Double>(m, d, start), of, taken, few);
    while (n_ >= width) go_on(width, few);
  }
  HPCCD_HD void end() {
    while (n_) go_on(n_ < width ? n_ : width, 0);
  }

 private:
  static constexpr std::uint32_t width = double_width;
  // Resuming a search costs as much as two steps.
  static constexpr int few = width < 4 ? 0 : width / 2;

  // Resumes the last n of the searches that were set aside.
  HPCCD_HD void go_on(std::uint32_t n, int keep) {
    n_ -= n;
    Chosen of;
    std::uint32_t taken[width] = {};
    SearchState<Double> state;
    alignas(64) double values[n_values][width];
    for (std::uint32_t lane = 0; lane < width; ++lane) {
      const std::uint32_t at = n_ + (lane < n ? lane : n - 1);
      of.of[lane] = number_[at];
      taken[lane] = taken_[at];
      for (int i = 0; i < n_values; ++i) values[i][lane] = values_[i][at];
    }
    __builtin_memcpy(&state, values, sizeof state);
    const std::uint32_t* v[width];
    for (std::uint32_t lane = 0; lane < width; ++lane) v[lane] = list_.vertices[of[lane]];
    const Motion<Double> m = load<kind>(g_, v, static_cast<Double*>(nullptr));
    const LaneNumbers<Chosen> numbers{of, 0, (1u << n) - 1};
    run(m, SeparationSearch<kind, Double>(m, separations_of_(numbers), state), numbers, taken, keep);
  }

  // Runs until at most `keep` searches are left, which are set aside. The others are decided or undecided.
  template <class Numbers>
  HPCCD_HD void run(const Motion<Double>& m, SeparationSearch<kind, Double> search, const LaneNumbers<Numbers>& of,
                    const std::uint32_t* taken, int keep) {
    std::uint32_t most = 0, steps = 0;
    for (std::uint32_t lane = 0; lane < width; ++lane) most = taken[lane] > most ? taken[lane] : most;
    unsigned running = bits(search.running()) & of.valid;
    for (; __builtin_popcount(running) > keep && most + steps < most_search_steps; ++steps) {
      search.step(m);
      running = bits(search.running()) & of.valid;
    }
    const Outcome<Double> o = search.outcome();
    const unsigned contact = bits(o.contact) & of.valid, none = bits(o.none) & of.valid;
    result_.counts.roots += static_cast<unsigned>(__builtin_popcount(none));
    const SearchState<Double> state = search.state();
    alignas(64) double values[n_values][width];
    __builtin_memcpy(values, &state, sizeof values);
    const double* up_to = values[0];
    for (unsigned lanes = of.valid & ~none; lanes; lanes &= lanes - 1) {
      const int lane = __builtin_ctz(lanes);
      if (contact >> lane & 1) {
        result_.contact[result_.n_contacts] = list_.at[of[lane]];
        result_.toc[result_.n_contacts] = up_to[lane];
        result_.delta[result_.n_contacts++] = 0;
      } else if (running >> lane & 1 && taken[lane] + steps < most_search_steps) {
        number_[n_] = of[lane];
        taken_[n_] = taken[lane] + steps;
        for (int i = 0; i < n_values; ++i) values_[i][n_] = values[i][lane];
        ++n_;
      } else {
        result_.undecided[result_.n_undecided] = list_.at[of[lane]];
        result_.apart_until[result_.n_undecided++] = up_to[lane];
      }
    }
  }

  static constexpr int n_values = sizeof(SearchState<Double>) / sizeof(Double);

  const Geometry& g_;
  const PairList& list_;
  const SeparationsOf& separations_of_;
  BatchResult& result_;
  std::uint32_t n_ = 0;  // set aside
  std::uint32_t number_[2 * width], taken_[2 * width];
  double values_[n_values][2 * width];
};
