// SPDX-License-Identifier: Apache-2.0
// How far apart two features shall stay, by their meshes.
#pragma once

#include <cstdint>

#include "base/hd.h"

namespace hpccd {

struct Separations {
  double uniform = 0;  // where there is neither table nor list
  const double* of_meshes = nullptr;
  const std::uint32_t* mesh_of_vertex = nullptr;
  std::uint32_t n_meshes = 0;
  const double* of_candidates = nullptr;  // of a batch

  // Of two features by one vertex of each.
  HPCCD_HD double between(std::uint32_t first, std::uint32_t second) const {
    return of_meshes ? of_meshes[mesh_of_vertex[first] * n_meshes + mesh_of_vertex[second]] : uniform;
  }
};

}  // namespace hpccd
