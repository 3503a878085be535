// SPDX-License-Identifier: Apache-2.0
// The edges of all triangles of a scene, each once.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/parallel.h"
#include "scene/features.h"

namespace hpccd {

// In lexicographic order, and of each the first triangle that has it.
struct Edges {
  std::vector<std::array<std::uint32_t, 2>> edges;
  std::vector<std::uint32_t> owner;
};

// Of x.faces. Of each vertex that is in a triangle it puts the first one into vertex_owner, which holds UINT32_MAX.
Edges find_edges(const Features& x, ThreadPool& pool, std::vector<std::uint32_t>& vertex_owner);

}  // namespace hpccd
