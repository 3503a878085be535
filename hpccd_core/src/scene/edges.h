// SPDX-License-Identifier: Apache-2.0
// The unique edges of a scene.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/parallel.h"
#include "scene/features.h"

namespace hpccd {

// In lexicographic order, and of each the primitive that represents it.
struct Edges {
  std::vector<std::array<std::uint32_t, 2>> edges;
  std::vector<std::uint32_t> owner;
};

// Those of x.faces, each represented by the first triangle that has it. Of each vertex that is in a triangle it puts
// the first one into vertex_owner, which holds UINT32_MAX.
Edges find_edges(const Features& x, ThreadPool& pool, std::vector<std::uint32_t>& vertex_owner);

// Those of `given` that are not in `all`, in lexicographic order. One from a vertex to itself is none.
std::vector<std::array<std::uint32_t, 2>> lone_edges(const std::vector<std::array<std::uint32_t, 2>>& given,
                                                     const Edges& all);

// Both together. first: the primitive that represents the first lone edge.
Edges with_lone_edges(Edges all, const std::vector<std::array<std::uint32_t, 2>>& lone, std::uint32_t first);

}  // namespace hpccd
