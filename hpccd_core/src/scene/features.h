// SPDX-License-Identifier: Apache-2.0
// The features of a scene, each assigned to one representative triangle so that every pair of features is tested once
// (Kim et al. 2009, section 6; Curtis et al. 2008).
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/parallel.h"
#include "hpccd/hpccd.h"

namespace hpccd {

// What an edge is part of. The edge from a point to itself and an edge of a face are never paired: the point is tested
// against the face.
enum class EdgeKind : unsigned char { lone, of_face, point = 3 };
constexpr bool never_paired(EdgeKind a, EdgeKind b) {
  return (static_cast<unsigned>(a) ^ static_cast<unsigned>(b)) == 2;
}
// By the kinds of edges of two meshes (Features::edge_kinds_of_mesh): whether no edges are paired, and whether some are
// not.
constexpr bool all_never_paired(unsigned a, unsigned b) { return (a == 2 && b == 8) || (a == 8 && b == 2); }
constexpr bool some_never_paired(unsigned a, unsigned b) { return (a & 2 && b & 8) || (a & 8 && b & 2); }

struct Features {
  // v0 < v1, and v0 = v1 for points; in lexicographic order: an edge's number is its rank.
  std::vector<std::array<std::uint32_t, 2>> edges;
  std::vector<std::array<std::uint32_t, 3>> faces;
  // The primitives of the hierarchy, by number: all triangles (the paper's representative triangles, to which features
  // are assigned), then edges of no triangle, then vertices of neither.
  std::vector<std::array<std::uint32_t, 2>> lone_edges;
  std::vector<std::uint32_t> lone_vertices;
  std::vector<std::uint32_t> mesh_of_primitive, mesh_of_vertex;
  // The features that primitive p represents: edges owned_edges[first_edge[p] .. first_edge[p+1]), vertices likewise.
  std::vector<std::uint32_t> first_edge, owned_edges, first_vertex, owned_vertices;
  std::uint32_t n_vertices = 0;
  std::vector<EdgeKind> edge_kinds;  // of edges; empty if there are no points
  // Of the edges of each mesh; empty as above. 2: all are of faces, 8: all are points, other values: other or several.
  std::vector<unsigned char> edge_kinds_of_mesh;

  std::size_t bytes() const {
    return edge_kinds.capacity() + edge_kinds_of_mesh.capacity() +
           (edges.capacity() + lone_edges.capacity()) * sizeof(edges[0]) + faces.capacity() * sizeof(faces[0]) +
           4 * (lone_vertices.capacity() + mesh_of_primitive.capacity() + mesh_of_vertex.capacity() +
                first_edge.capacity() + owned_edges.capacity() + first_vertex.capacity() + owned_vertices.capacity());
  }
  std::uint32_t n_faces() const { return static_cast<std::uint32_t>(faces.size()); }
  std::uint32_t first_lone_edge() const { return n_faces(); }
  std::uint32_t first_lone_vertex() const { return n_faces() + static_cast<std::uint32_t>(lone_edges.size()); }
  std::uint32_t n_primitives() const { return static_cast<std::uint32_t>(mesh_of_primitive.size()); }
};

// The result does not depend on the number of threads.
Features features_of(const Scene& scene, ThreadPool& pool);
Features features_of(const Scene& scene);  // on the calling thread

}  // namespace hpccd
