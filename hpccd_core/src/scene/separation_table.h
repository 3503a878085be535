// SPDX-License-Identifier: Apache-2.0
// The current minimum separation of each pair of meshes.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "hpccd/hpccd.h"
#include "scene/pair_table.h"
#include "scene/tested_pairs.h"

namespace hpccd {

// Properties of all pairs refer to tested pairs only: the others do not grow boxes.
class SeparationTable {
 public:
  SeparationTable(const Scene& scene, double otherwise);

  double of(std::uint32_t mesh_a, std::uint32_t mesh_b) const { return of_.of(mesh_a, mesh_b); }
  // The separation of pairs that are not set.
  double otherwise() const { return of_.otherwise(); }
  // May be called repeatedly: properties of all pairs change only in settle().
  void set(std::uint32_t mesh_a, std::uint32_t mesh_b, double separation);
  void settle();
  // Differs between any two states in which a tested pair differs.
  std::uint64_t version() const { return version_; }
  // Tested pairs that were set since the last settle().
  const std::vector<std::array<std::uint32_t, 2>>& changed() const { return changed_; }

  bool any() const { return most_ > 0; }
  bool uniform() const { return uniform_; }
  double first() const { return first_; }
  double most() const { return most_; }
  // Calls f(mesh_a, mesh_b, separation), mesh_a <= mesh_b, for all pairs that differ from otherwise(), and possibly for
  // others.
  template <class Function>
  void for_pairs(Function&& f) const {
    for (std::uint32_t a = 0; a < largest_.size(); ++a)
      of_.for_pairs_of(a, [&](std::uint32_t b, double d) {
        if (a <= b) f(a, b, d);
      });
  }
  PairValues<double> of_pairs() const { return of_.view(); }
  // By mesh: the largest separation of its pairs. Empty if no pair has a separation.
  const std::vector<double>& largest() const { return any() ? largest_ : none_; }
  std::size_t bytes() const {
    return of_.bytes() + tested_.bytes() + largest_.capacity() * sizeof(double) +
           changed_.capacity() * sizeof(changed_[0]);
  }

 private:
  double largest_of(std::uint32_t mesh) const;
  void look_at_all();

  TestedPairs tested_;
  PairTable<double> of_;
  std::map<double, std::size_t> n_with_value_;  // tested pairs
  std::vector<std::array<std::uint32_t, 2>> changed_;
  std::vector<double> largest_, none_;
  std::uint64_t version_ = 1;
  double most_ = 0, first_ = 0;
  bool uniform_ = true;
};

}  // namespace hpccd
