// SPDX-License-Identifier: Apache-2.0
// Candidates in the form in which they are found: a feature of one leaf, and one bit for each feature of the other.
// They are written out together, because whether there are any is known late, and the branch would be mispredicted
// every third time. Part of leaf_pairs.inl and leaf_edge_faces.inl.

class CandidateRows {
 public:
  HPCCD_HD void add(std::uint32_t number, unsigned others) {
    rows_[n_] = {number, others};
    n_ += others != 0;
  }
  // Appends the pairs with the n features in `others`.
  HPCCD_HD void append_to(std::uint32_t* first, std::uint32_t* second, std::uint32_t& n_pairs,
                          const std::uint32_t* others, std::uint32_t n) const {
    for (std::uint32_t begin = 0; begin < n; begin += 16) {
      const Numbers16 numbers = load_numbers(others + begin);
      for (std::uint32_t i = 0; i < n_; ++i)
        append_pairs(first, second, n_pairs, rows_[i].number, numbers, rows_[i].others >> begin & 0xFFFF);
    }
  }

 private:
  std::uint32_t n_ = 0;
  struct {
    std::uint32_t number, others;
  } rows_[CornersOf::most_edges + 1];  // writes one pair more than it counts
};
