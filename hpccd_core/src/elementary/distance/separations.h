// SPDX-License-Identifier: Apache-2.0
// The minimum separation of two features: that of their meshes, plus the thickness of both.
#pragma once

#include <cstdint>

#include "base/hd.h"
#include "elementary/motion.h"
#include "scene/pair_table.h"
#include "scene/thickness.h"

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
  Thicknesses thickness = {};
  bool may_be_zero = false;  // of pairs with a rule for separations

  // The separation of two features, by one vertex of each.
  HPCCD_HD double between(std::uint32_t first, std::uint32_t second) const {
    return of_meshes ? of_meshes[mesh_of_vertex[first] * n_meshes + mesh_of_vertex[second]] : uniform;
  }
  HPCCD_HD bool thick() const { return thickness.of_vertex; }
  bool to_look_up() const { return of_pairs.keys; }
  // The thickness of both features, by number.
  HPCCD_HD double thickness_of(Kind kind, std::uint32_t first, std::uint32_t second) const {
    if (!thick()) return 0;
    const double a = kind == Kind::vertex_face ? thickness.of_vertex[first] : thickness.of_edge[first];
    return a + (kind == Kind::edge_edge ? thickness.of_edge[second] : thickness.of_face[second]);
  }
  // v: vertices of the pair. The sum is rounded, and then counts as exact.
  double look_up(Kind kind, std::uint32_t first, std::uint32_t second, const std::uint32_t v[4]) const {
    const double of_both =
        of_pairs.keys ? of_pairs.of(mesh_of_vertex[v[0]], mesh_of_vertex[v[2]]) : between(v[0], v[2]);
    return of_both + thickness_of(kind, first, second);
  }
};

}  // namespace hpccd
