// SPDX-License-Identifier: Apache-2.0
// A mesh divided into patches: each of its faces is mapped to one face of a coarser mesh on the same vertices.
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/parallel.h"
#include "hpccd/positions.h"

namespace hpccd::detail {

using Face = std::array<std::uint32_t, 3>;
using Edge = std::array<std::uint32_t, 2>;
inline constexpr std::uint32_t no_vertex = 0xFFFFFFFFu;

// A multiple of 2^-15 in [0, 1]. Those of one point have a sum of at most 1. Double precision holds 1 - s and
// 1 - b1 - b2 exactly. The pass over all corners waits for memory: they are short.
struct Weight {
  std::uint16_t parts = 0;
  operator double() const { return parts * 0x1p-15; }
  auto operator<=>(const Weight&) const = default;
};

// A vertex, and its point (1 - b1 - b2) X0 + b1 X1 + b2 X2 on a coarse face.
struct MappedVertex {
  std::uint32_t vertex;
  Weight b1, b2;
  auto operator<=>(const MappedVertex&) const = default;
};
// The point (1 - s) v + s w of an edge, and its point on a coarse face.
struct MappedPoint {
  std::uint32_t v, w;
  Weight s, b1, b2;
  auto operator<=>(const MappedPoint&) const = default;
};
// The point (1 - s) v + s w of an edge, and its point (1 - r) a + r b on a coarse edge.
struct Crossing {
  std::uint32_t v, w;
  Weight s, r;
  auto operator<=>(const Crossing&) const = default;
};

// Rows by number: rows[first[i] .. first[i + 1]).
template <class T>
struct Grouped {
  std::vector<std::uint32_t> first;
  std::vector<T> rows;
  std::span<const T> operator[](std::size_t i) const {
    return std::span(rows).subspan(first[i], first[i + 1] - first[i]);
  }
};

// The faces of a mesh, cut into pieces where they cross coarse edges. Each piece is a triangle that is mapped affinely
// to one coarse face; the pieces of a coarse face are its patch. A corner of a piece is a corner of the coarse face
// itself, or one of those listed.
struct Patches {
  std::vector<Face> faces;         // coarse faces, those with a piece
  Grouped<std::uint32_t> held;     // by coarse face: the faces that have a piece in it
  Grouped<MappedVertex> vertices;  // by coarse face
  Grouped<MappedPoint> points;     // by coarse face
  // Coarse edges that are crossed. Edges first_edge[c] to first_edge[c + 1] are at coarse face c and none before it: a
  // pass over the faces that measures these too reads each position once.
  std::vector<Edge> edges;
  std::vector<std::uint32_t> first_edge;
  Grouped<Crossing> crossings;     // by crossed edge
  Grouped<std::uint32_t> crossed;  // by coarse face: its crossed edges
};

// faces: of the mesh. proposed: faces of the coarser mesh. survivor: by vertex of the mesh, a vertex of the coarser
// mesh near it, or no_vertex. rest: the shape at which the patches are chosen. A face with a corner whose survivor is
// in no proposed face remains as it is. The result does not depend on the number of threads. Throws InvalidArgument if
// an index is out of range.
Patches patches_of(std::span<const Face> faces, std::span<const Face> proposed, std::span<const std::uint32_t> survivor,
                   Positions rest, ThreadPool& pool);

// The largest magnitude of a coordinate of each mesh. first_vertex: of each mesh, then the number of all vertices.
// Throws InvalidArgument naming `name` if a coordinate is not finite or its magnitude is above `most`.
std::vector<double> largest_coordinates(const char* name, Positions vertices,
                                        std::span<const std::int64_t> first_vertex, double most, ThreadPool& pool);

// Coordinates and squares of distances beyond this look wrong, and are checked (largest_coordinates).
inline constexpr double most_unchecked = 1e150, most_coordinate_unchecked = 1e75;

// For each coarse face, the largest distance of a corner of a piece to the point to which it is mapped, rounded up: no
// point of the patch is farther from its own point on the coarse face, since the distance is a convex function of the
// place in the piece (and of time, if vertices move on straight lines: the larger one of both ends bounds it in
// between). Zero, without rounding, where the patch is the coarse face itself. vertices: of all meshes; first_vertex:
// that of this mesh; largest: the largest magnitude of its coordinates, if they have been checked. Otherwise nothing is
// returned if a coordinate may be NaN, infinite or huge. Stops early if a distance is above `most`: then at least one
// value is, and the others are not complete.
std::optional<std::vector<double>> deviations(const Patches& patches, Positions vertices, std::uint32_t first_vertex,
                                              std::optional<double> largest, double most, ThreadPool& pool);

// The features of coarse faces, for their deviations: an edge or a vertex has the greatest of its faces, and 0 without
// faces.
class CoarseFeatures {
 public:
  CoarseFeatures(std::span<const Face> faces, std::size_t n_vertices);
  // For each pair the sum of both sides, rounded up. vf, then ee: as in Contacts.
  std::vector<double> bounds(std::span<const std::array<std::uint32_t, 2>> vf,
                             std::span<const std::array<std::uint32_t, 4>> ee, std::span<const double> of_faces) const;

 private:
  std::uint32_t edge(std::uint32_t a, std::uint32_t b) const;

  std::vector<Face> faces_, edges_of_face_;
  std::vector<std::uint32_t> first_, upper_;  // edges by their lower vertex: first_[v] to first_[v + 1]; upper vertices
};

// Pairs of features of the coarse mesh that belong to neighbours only, and share no vertex. Two coarse faces are
// neighbours if they share a vertex, or if faces of their patches do. Lone edges count as patches of their own.
struct NeighbourPairs {
  std::vector<std::array<std::uint32_t, 2>> vf;  // vertex of the mesh, coarse face
  std::vector<std::array<std::uint32_t, 4>> ee;  // as in Contacts::ee
  std::vector<std::array<std::uint32_t, 3>> ef;  // as in Intersections::ef
};
NeighbourPairs neighbour_pairs(std::span<const Face> faces, const Patches& patches, std::span<const Edge> lone_edges,
                               std::size_t n_vertices, ThreadPool& pool);

}  // namespace hpccd::detail
