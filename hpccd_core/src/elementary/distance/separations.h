// SPDX-License-Identifier: Apache-2.0
// The minimum separation of two features, looked up by their meshes.
#pragma once

#include <cstdint>

#include "base/hd.h"
#include "scene/pair_table.h"

namespace hpccd {

struct Separations {
  double uniform = 0;  // if there is neither table nor list
  const double* of_meshes = nullptr;
  const std::uint32_t* mesh_of_vertex = nullptr;
  std::uint32_t n_meshes = 0;
  const double* of_candidates = nullptr;  // for a batch
  // For many meshes, in place of the table: a batch passes the separations of its candidates. Looking them up in the
  // code of the lanes would slow down every batch of distances by a tenth.
  PairValues<double> of_pairs = {};

  // The separation of two features, by one vertex of each.
  HPCCD_HD double between(std::uint32_t first, std::uint32_t second) const {
    return of_meshes ? of_meshes[mesh_of_vertex[first] * n_meshes + mesh_of_vertex[second]] : uniform;
  }
  bool to_look_up() const { return of_pairs.keys; }
  double look_up(std::uint32_t first, std::uint32_t second) const {
    return to_look_up() ? of_pairs.of(mesh_of_vertex[first], mesh_of_vertex[second]) : between(first, second);
  }
};

}  // namespace hpccd
