// SPDX-License-Identifier: Apache-2.0
// The minimum separation of each pair of meshes, as it is now.
#pragma once

#include <cstdint>
#include <vector>

#include "hpccd/hpccd.h"

namespace hpccd {

class SeparationTable {
 public:
  SeparationTable(const Scene& scene, double otherwise);

  double of(std::uint32_t mesh_a, std::uint32_t mesh_b) const { return of_[mesh_a * n_ + mesh_b]; }
  // Many may follow each other: what says something of all pairs is as it was until settle().
  void set(std::uint32_t mesh_a, std::uint32_t mesh_b, double separation);
  void settle();
  // Of no two states of one table the same.
  std::uint64_t version() const { return version_; }

  bool any() const { return any_; }
  bool uniform() const { return uniform_; }
  double first() const { return of_.empty() ? 0 : of_[0]; }
  double most() const { return most_; }
  const std::vector<double>& all() const { return of_; }  // n_meshes^2
  // By mesh: the largest of its pairs. Empty where no pair has a separation.
  const std::vector<double>& largest() const { return largest_; }

 private:
  std::size_t n_;
  std::uint64_t version_ = 1;
  std::vector<double> of_, largest_;
  double most_ = 0;
  bool any_ = false, uniform_ = true;
};

}  // namespace hpccd
