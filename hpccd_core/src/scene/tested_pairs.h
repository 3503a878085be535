// SPDX-License-Identifier: Apache-2.0
// The pairs of meshes that are tested. Planes have no features: they are tested apart from all meshes
// (backends/planes.h), and no pair of theirs counts here.
#pragma once

#include <cstdint>
#include <vector>

#include "scene/pair_table.h"
#include "scene/scene_pairs.h"

namespace hpccd {

class TestedPairs {
 public:
  explicit TestedPairs(const Scene& scene);

  bool all() const { return all_; }
  // Whether a table of all pairs exists, or none is needed. If all() is true, the table is not read.
  bool by_table() const { return all_ || not_ignored_.has_all(); }
  bool in_table(std::uint32_t mesh_a, std::uint32_t mesh_b) const {
    return all_ || not_ignored_.in_table(mesh_a, mesh_b);
  }
  bool of(std::uint32_t mesh_a, std::uint32_t mesh_b) const {
    if (not_ignored_.has_all()) return not_ignored_.in_table(mesh_a, mesh_b);
    return by_meshes(mesh_a, mesh_b) && not_ignored_.of(mesh_a, mesh_b);
  }
  // Pairs of two meshes or of one, each once.
  std::size_t n_pairs() const { return n_pairs_; }
  // Number of meshes with which this one is tested, itself included.
  std::size_t n_with(std::uint32_t mesh) const { return n_with_[mesh]; }
  std::size_t bytes() const {
    return not_ignored_.bytes() + meshes_.capacity() + n_with_.capacity() * sizeof(n_with_[0]);
  }

 private:
  enum : unsigned char { is_static = 1, within = 2, is_plane = 4 };
  // By the options of the meshes.
  bool by_meshes(std::uint32_t a, std::uint32_t b) const {
    return !(meshes_[a] & meshes_[b] & is_static) && !((meshes_[a] | meshes_[b]) & is_plane) &&
           (a != b || meshes_[a] & within);
  }

  std::vector<unsigned char> meshes_;
  PairTable<unsigned char> not_ignored_;  // a table of all pairs includes the options
  std::vector<std::size_t> n_with_;
  std::size_t n_pairs_ = 0;
  bool all_ = true;
};

}  // namespace hpccd
