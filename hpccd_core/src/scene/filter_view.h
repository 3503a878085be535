// SPDX-License-Identifier: Apache-2.0
// Read access to a filter of pairs of features (feature_filter.h), without the standard library: the same on CPUs and
// devices.
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/hd.h"

namespace hpccd {

// Values of each row, ascending; nothing if no row has any.
struct RowsView {
  const std::uint32_t *first = nullptr, *values = nullptr;

  HPCCD_HD explicit operator bool() const { return first != nullptr; }
  HPCCD_HD bool has(std::uint32_t row, std::uint32_t value) const {
    if (!first) return false;
    std::uint32_t begin = first[row], n = first[row + 1] - begin;
    if (n == 0) return false;
    // Without branches that depend on values, which would be mispredicted every other time.
    while (n > 1) {
      const std::uint32_t half = n / 2;
      begin += values[begin + half] <= value ? half : 0;
      n -= half;
    }
    return values[begin] == value;
  }
};

// Which pairs are ignored, by numbers of features in the scene. Pairs with a common vertex are never asked about.
struct FilterView {
  const std::uint32_t *edges = nullptr, *faces = nullptr, *mesh_of_vertex = nullptr;  // two, three vertices each
  RowsView near;                                        // vertices after each vertex within the rings of its mesh
  RowsView vf, ee, ef;                                  // by vertex, first edge, edge
  RowsView vertex_against, edge_against, face_against;  // numbers of meshes

  HPCCD_HD bool vertex_face(std::uint32_t vertex, std::uint32_t face) const {
    const std::uint32_t* f = faces + 3 * std::size_t{face};
    if (near && (are_near(vertex, f[0]) || are_near(vertex, f[1]) || are_near(vertex, f[2]))) return true;
    if (vf.has(vertex, face)) return true;
    if (!face_against) return false;
    return vertex_against.has(vertex, mesh_of_vertex[f[0]]) || face_against.has(face, mesh_of_vertex[vertex]);
  }
  HPCCD_HD bool edge_edge(std::uint32_t a, std::uint32_t b) const {
    const std::uint32_t *v = edges + 2 * std::size_t{a}, *w = edges + 2 * std::size_t{b};
    if (near && (are_near(v[0], w[0]) || are_near(v[0], w[1]) || are_near(v[1], w[0]) || are_near(v[1], w[1])))
      return true;
    if (a < b ? ee.has(a, b) : ee.has(b, a)) return true;
    if (!face_against) return false;
    return edge_against.has(a, mesh_of_vertex[w[0]]) || edge_against.has(b, mesh_of_vertex[v[0]]);
  }
  HPCCD_HD bool edge_face(std::uint32_t edge, std::uint32_t face) const {
    const std::uint32_t *v = edges + 2 * std::size_t{edge}, *f = faces + 3 * std::size_t{face};
    if (near)
      for (int i = 0; i < 3; ++i)
        if (are_near(v[0], f[i]) || are_near(v[1], f[i])) return true;
    if (ef.has(edge, face)) return true;
    if (!face_against) return false;
    return edge_against.has(edge, mesh_of_vertex[f[0]]) || face_against.has(face, mesh_of_vertex[v[0]]);
  }

 private:
  HPCCD_HD bool are_near(std::uint32_t v, std::uint32_t w) const { return v < w ? near.has(v, w) : near.has(w, v); }
};

}  // namespace hpccd
