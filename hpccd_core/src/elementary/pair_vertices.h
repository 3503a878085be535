// SPDX-License-Identifier: Apache-2.0
// The vertices of a pair of features, in the order of the public queries: v f0 f1 f2 (vertex-face) or a0 a1 b0 b1
// (edge-edge).
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/hd.h"
#include "elementary/motion.h"

namespace hpccd {

// edge(i) and face(i) return an object with the vertices of edge or face number i at [0], [1] and [2].
template <Kind kind, class Edge, class Face>
HPCCD_HD void pair_vertices(std::uint32_t first, std::uint32_t second, Edge&& edge, Face&& face, std::uint32_t v[4]) {
  if constexpr (kind == Kind::vertex_face) {
    const auto f = face(second);
    v[0] = first, v[1] = f[0], v[2] = f[1], v[3] = f[2];
  } else {
    const auto a = edge(first), b = edge(second);
    v[0] = a[0], v[1] = a[1], v[2] = b[0], v[3] = b[1];
  }
}

// The vertices of edges (n = 2) or faces (n = 3), consecutive in memory.
template <std::size_t n>
struct VertexLists {
  const std::uint32_t* vertices;
  HPCCD_HD const std::uint32_t* operator()(std::uint32_t i) const { return vertices + n * i; }
};

template <Kind kind>
HPCCD_HD void pair_vertices(const std::uint32_t* edges, const std::uint32_t* faces, std::uint32_t first,
                            std::uint32_t second, std::uint32_t v[4]) {
  pair_vertices<kind>(first, second, VertexLists<2>{edges}, VertexLists<3>{faces}, v);
}

}  // namespace hpccd
