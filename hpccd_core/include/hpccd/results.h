// SPDX-License-Identifier: Apache-2.0
// Results of a Detector. Plain data: a copy is independent of the detector. Indices are scene-wide, as numbered in the
// Scene. Times are fractions of the step, in [0, 1]. Lengths and points are in units of the coordinates.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "hpccd/export.h"

namespace hpccd {
inline namespace v0_1 {

/// Rows of each world in the arrays of all worlds. Empty for a detector of one world.
struct WorldSlices {
  std::vector<std::uint64_t> vf;      ///< worlds + 1 offsets: world k has the rows from [k] to [k + 1]
  std::vector<std::uint64_t> ee;      ///< as vf
  std::vector<std::uint64_t> ef;      ///< as vf
  std::vector<std::uint64_t> vp;      ///< as vf
  std::vector<std::uint64_t> vv;      ///< as vf
  std::vector<std::uint64_t> ve;      ///< as vf
  std::vector<std::uint64_t> hashes;  ///< the hash of each world
};

/// Contacts of one motion step in canonical order, the same on every backend and for any number of threads: vertex-face
/// by (vertex, face), then edge-edge by (a0, a1, b0, b1), with a0 < a1, b0 < b1 and (a0, a1) < (b0, b1).
struct Contacts {
  std::vector<std::array<std::uint32_t, 2>> vf;  ///< vertex, face
  std::vector<double> vf_toc;                    ///< time of impact: the earliest time at which the two touch
  std::vector<std::array<std::uint32_t, 4>> ee;  ///< the vertices of both edges
  std::vector<double> ee_toc;                    ///< time of impact
  std::vector<std::array<std::uint32_t, 2>> vp;  ///< vertex, plane: planes are counted in the order added
  std::vector<double> vp_toc;                    ///< time of impact; 0 if the vertex starts outside the half-space
  std::vector<std::array<std::uint32_t, 2>> vv;  ///< two points, the lower number first
  std::vector<double> vv_toc;                    ///< time of impact
  std::vector<std::array<std::uint32_t, 3>> ve;  ///< point, and the vertices of an edge of no face
  std::vector<double> ve_toc;                    ///< time of impact
  /// Contact points: rows of vf, ee, vp, vv and ve, as in all arrays below; empty unless requested in Options. With a
  /// minimum separation, the midpoints of the nearest points at toc.
  std::vector<std::array<double, 3>> points;
  /// Unit normals: vf rows, then ee rows; empty unless requested in Options. The normal points to the side of the face
  /// on which the vertex is just before toc, or from edge a to the side on which edge b is then. For a contact at t = 0
  /// it points to where the straight-line motion would have come from. It is zero if the motion is coplanar throughout,
  /// or if the features are degenerate or parallel at toc. With a minimum separation, it is the direction from face to
  /// vertex or from edge a to b.
  std::vector<std::array<double, 3>> normals;
  std::vector<std::array<std::array<double, 3>, 2>> closest;  ///< nearest points of both sides at toc
  /// The four vertices of each pair, vf rows first: v f0 f1 f2, or a0 a1 b0 b1; empty unless weights are requested.
  std::vector<std::array<std::uint32_t, 4>> vertices;
  /// Weights of these vertices at toc: 1 -l0 -l1 -l2 with the barycentric coordinates of the point on the face, or -(1
  /// - s) -s 1 - u u with the positions s and u on edges a and b. Their weighted sum is the vector from the point on
  /// the face to the vertex, or from edge a to edge b: zero in plain contact, the gap with a minimum separation.
  std::vector<std::array<double, 4>> weights;
  /// Derivative of the gap with respect to time at toc: normal times the weighted sum of the vertices' motions.
  /// Negative while the features approach each other; 0 where they only graze each other, within rounding errors of the
  /// motion, or where the normal is zero.
  std::vector<double> approach;
  double first_toc = std::numeric_limits<double>::infinity();  ///< infinite without contacts
  /// Hash of features and times: the same for the same contacts on every backend and for any number of threads. For
  /// several worlds, the sum over worlds k of their hashes times 2 k + 1.
  std::uint64_t hash = 0;
  /// For several worlds: rows of world 0 come first, then those of world 1, and so on.
  WorldSlices slices;
  std::vector<double> first_tocs;  ///< of each world; empty for one world
};

/// A motion without contacts, made of a given one by shortening the motion of each vertex. For several worlds, rows of
/// world 0 come first.
struct CollisionFreeMotion {
  /// x y z of each vertex at its end. Numbers of the type that the positions had: the straight motion to exactly these
  /// has no contact, except between features that are in contact at t = 0.
  std::vector<double> vertices;
  std::vector<double> factors;       ///< by vertex, the part of its own motion that it keeps, in [0, 1]
  std::vector<std::uint32_t> stuck;  ///< vertices of pairs in contact at t = 0, whose factor is 0, sorted
};

/// Pairs of features within a distance of each other in one frame, in the order of Contacts.
struct Proximity {
  std::vector<std::array<std::uint32_t, 2>> vf;               ///< vertex, face
  std::vector<double> vf_distance;                            ///< Euclidean distance
  std::vector<std::array<std::uint32_t, 4>> ee;               ///< the vertices of both edges
  std::vector<double> ee_distance;                            ///< Euclidean distance
  std::vector<std::array<std::uint32_t, 2>> vp;               ///< vertex, plane, as in Contacts
  std::vector<double> vp_distance;                            ///< negative outside the half-space
  std::vector<std::array<std::uint32_t, 2>> vv;               ///< two points, as in Contacts
  std::vector<double> vv_distance;                            ///< Euclidean distance
  std::vector<std::array<std::uint32_t, 3>> ve;               ///< point and edge, as in Contacts
  std::vector<double> ve_distance;                            ///< Euclidean distance
  std::vector<std::array<std::array<double, 3>, 2>> closest;  ///< vf rows first; empty unless requested
  /// Unit vectors from the point on the face to the vertex, or from edge a to edge b; zero at distance 0. Empty unless
  /// requested.
  std::vector<std::array<double, 3>> normals;
  std::vector<std::array<std::uint32_t, 4>> vertices;  ///< as in Contacts
  std::vector<std::array<double, 4>> weights;          ///< as in Contacts, of the nearest points
  std::uint64_t hash = 0;                              ///< hash of features and distances, as in Contacts
  WorldSlices slices;                                  ///< for several worlds, as in Contacts
};

/// Edges that intersect or touch faces in one frame, in lexicographic order.
struct Intersections {
  std::vector<std::array<std::uint32_t, 3>> ef;  ///< edge vertices a0 < a1, face
  std::uint64_t hash = 0;                        ///< hash of the pairs, as in Contacts
  WorldSlices slices;                            ///< for several worlds, as in Contacts
  /// Where the edge meets the face; as the next three, empty unless Options::points is set. Where they share a segment,
  /// its end nearer to the edge's first vertex.
  std::vector<std::array<double, 3>> points;
  std::vector<double> edge_parameters;         ///< position on the edge, from 0 at its first vertex to 1
  std::vector<std::array<double, 3>> weights;  ///< barycentric coordinates on the face, in [0, 1]
  /// What holds exactly, as bits. 1, 2: they meet at the edge's first, second vertex. 4, 8, 16: the weight of the
  /// face's first, second, third vertex is 0. 32: the edge lies in the plane of the face, or the face has no area.
  std::vector<std::uint8_t> incidences;
  /// The vector G of Volino and Magnenat-Thalmann 2006: moving the edge by D / 2 and the face by -D / 2 changes the
  /// length of the intersection curves by -G . D / 2. Empty unless Options::directions is set.
  std::vector<std::array<double, 3>> directions;
};

/// The kind of the closest pair of features. none: no pair exists. edge_face: the meshes intersect.
enum class GapKind : std::uint8_t { none, vertex_face, edge_edge, edge_face, vertex_plane, vertex_vertex, vertex_edge };
/// Which of the two meshes of a gap lies inside the other.
enum class Inside : std::uint8_t { none, a, b, both };
/// The smallest distance of two meshes in one frame, and whether one lies inside the other.
struct Gap {
  std::uint32_t mesh_a;  ///< number of the first mesh
  std::uint32_t mesh_b;  ///< number of the second mesh, >= mesh_a
  /// Of the surfaces, also if one mesh lies inside the other; infinite for none. With thickness the distance of the
  /// centre surfaces minus that of both features, so negative where thick surfaces overlap. For edge_face 0 minus the
  /// thickness of the edge and face in `features`.
  double distance = std::numeric_limits<double>::infinity();
  GapKind kind = GapKind::none;                   ///< kind of the closest pair of features
  std::array<std::uint32_t, 4> features{};        ///< as in vf, ee or ef, then zeros
  std::array<std::array<double, 3>, 2> points{};  ///< the nearest points of both meshes
  /// As in Proximity, of the closest pair; zero for edge_face and none. The derivative of the distance with respect to
  /// the position of vertices[i] is weights[i] times the normal.
  std::array<std::uint32_t, 4> vertices{};
  std::array<double, 4> weights{};  ///< see vertices
  std::array<double, 3> normal{};   ///< zero at distance 0; see vertices
  /// a: a connected component of mesh_a (features joined by shared vertices: of faces, edges or a single vertex) lies
  /// inside mesh_b without touching it: the winding number of mesh_b around it is not 0. Exact; none where the surfaces
  /// touch, without any thickness, and within a mesh. Where contacts of the two meshes are ignored, one vertex of each
  /// component decides, of a connected mesh also its box. Only closed meshes contain anything: each edge of their faces
  /// is in exactly two of them, in opposite directions.
  Inside inside = Inside::none;
};

/// Winding numbers of points with respect to a closed mesh, exact.
struct WindingNumbers {
  /// 0 outside, +1 inside a mesh whose faces are counterclockwise seen from outside; 0 for points on the surface.
  std::vector<std::int32_t> numbers;
  std::vector<std::uint8_t> on_surface;  ///< 1 where a face contains the point, else 0
};

/// Signed distances of points to a closed mesh.
struct SignedDistances {
  /// Euclidean distance to the surface: negative where the winding number is not 0, 0 exactly on the surface.
  std::vector<double> distance;
  std::vector<std::uint32_t> faces;            ///< the nearest face; of several with the same distance the lowest
  std::vector<std::array<double, 3>> closest;  ///< the nearest point on that face
};

/// A translation that separates two meshes, and the depth at which they penetrate each other.
struct Penetration {
  std::array<double, 3> translation{};  ///< of mesh a; zero if the meshes are free of each other
  double depth = 0;                     ///< its length
  double lower_bound = 0;               ///< no shorter translation separates them
  /// The features that touch after the translation; none where the meshes are free, or where fewer vertices touch.
  GapKind kind = GapKind::none;
  std::array<std::uint32_t, 4> features{};  ///< vertex and face, or two edges (of mesh a first), then zeros
};

/// Results in a GPU's memory, complete when the call returns. Rows and order are those of Contacts, Proximity and
/// Intersections. Later calls do not write to the memory while `memory` is held; afterwards they reuse it. It may
/// outlive the detector.
struct DeviceResults {
  std::shared_ptr<const void> memory;                             ///< owns all arrays below
  int device = -1;                                                ///< number of the device; -1: page-locked host memory
  std::uint64_t n_vf = 0;                                         ///< rows of vf
  std::uint64_t n_ee = 0;                                         ///< rows of ee
  std::uint64_t n_ef = 0;                                         ///< rows of ef
  const std::array<std::uint32_t, 2>* vf = nullptr;               ///< vertex, face
  const std::array<std::uint32_t, 4>* ee = nullptr;               ///< the vertices of both edges
  const std::array<std::uint32_t, 3>* ef = nullptr;               ///< edge vertices, face
  const double* values = nullptr;                                 ///< times of impact, or distances: n_vf, then n_ee
  const std::array<double, 3>* points = nullptr;                  ///< n_vf + n_ee rows; null unless requested
  const std::array<double, 3>* normals = nullptr;                 ///< n_vf + n_ee rows; null unless requested
  const std::array<std::array<double, 3>, 2>* closest = nullptr;  ///< n_vf + n_ee rows; null unless requested
  const std::array<std::uint32_t, 4>* vertices = nullptr;         ///< n_vf + n_ee rows; null unless requested
  const std::array<double, 4>* weights = nullptr;                 ///< n_vf + n_ee rows; null unless requested
  const double* approach = nullptr;                            ///< n_vf + n_ee rows, of contacts; null unless requested
  double first_toc = std::numeric_limits<double>::infinity();  ///< infinite without contacts
  std::uint64_t hash = 0;                                      ///< as in Contacts
  const std::uint64_t* vf_offsets = nullptr;  ///< for several worlds, otherwise null; as in WorldSlices
  const std::uint64_t* ee_offsets = nullptr;  ///< as vf_offsets
  const std::uint64_t* ef_offsets = nullptr;  ///< as vf_offsets
  const std::uint64_t* hashes = nullptr;      ///< the hash of each world, otherwise null
  const double* first_tocs = nullptr;         ///< for several worlds, otherwise null; as in Contacts
};

/// Contacts without a copy: rows in the page-locked memory that a GPU has written, or else vectors.
struct Detected {
  std::optional<DeviceResults> in_place;  ///< the rows, if a GPU has computed them
  Contacts contacts;                      ///< otherwise
};

}  // namespace v0_1
}  // namespace hpccd
