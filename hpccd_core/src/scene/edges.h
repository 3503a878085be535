// SPDX-License-Identifier: Apache-2.0
// The unique edges of a scene.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/parallel.h"
#include "scene/features.h"

namespace hpccd {

// Edges in lexicographic order, and the primitive that represents each.
struct Edges {
  std::vector<std::array<std::uint32_t, 2>> edges;
  std::vector<std::uint32_t> owner;
};

// The edges of x.faces, each represented by the first triangle that contains it. Writes the first triangle of each
// vertex to vertex_owner, whose elements must be UINT32_MAX.
Edges find_edges(const Features& x, ThreadPool& pool, std::vector<std::uint32_t>& vertex_owner);

// The edges in `given` that are not in `all`, in lexicographic order. Edges from a vertex to itself are skipped.
std::vector<std::array<std::uint32_t, 2>> lone_edges(const std::vector<std::array<std::uint32_t, 2>>& given,
                                                     const Edges& all);

// All edges. first: the primitive that represents the first lone edge.
Edges with_lone_edges(Edges all, const std::vector<std::array<std::uint32_t, 2>>& lone, std::uint32_t first);

}  // namespace hpccd
