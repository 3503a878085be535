// SPDX-License-Identifier: Apache-2.0
// The enabled pairs of meshes, numbered, so that data per pair takes no memory for disabled ones.
#pragma once

#include <array>
#include <vector>

#include "traverse/tasks.h"

namespace hpccd {

class MeshPairs {
 public:
  MeshPairs(const PairRules& rules, std::size_t n_meshes);

  std::size_t size() const { return pairs_.size(); }
  // By number: (mesh_a, mesh_b) in their order, mesh_a <= mesh_b.
  const std::array<std::uint32_t, 2>& operator[](std::size_t number) const { return pairs_[number]; }
  // The number of an enabled pair, in any order.
  std::uint32_t number(std::uint32_t mesh_a, std::uint32_t mesh_b) const { return number_[mesh_a * n_ + mesh_b]; }
  std::size_t bytes() const { return pairs_.capacity() * sizeof(pairs_[0]) + number_.capacity() * sizeof(number_[0]); }

 private:
  std::size_t n_;
  std::vector<std::array<std::uint32_t, 2>> pairs_;
  std::vector<std::uint32_t> number_;
};

}  // namespace hpccd
