// SPDX-License-Identifier: Apache-2.0
// Meshes, and which pairs of them are tested.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <unordered_set>
#include <utility>
#include <vector>

#include "hpccd/export.h"

namespace hpccd {
inline namespace v0_1 {

/// Accuracy tiers and their promises:
///
/// - exact: contacts as rational arithmetic on the given coordinates decides; times within 1e-12
/// - conservative: no false negatives; no time later than the true one
/// - balanced: double precision; errors only within about 1e-12 of a border
/// - fast: single precision; no promise, errors of times mostly below 1e-3 of the step
enum class Accuracy : std::uint8_t { fast, balanced, conservative, exact };

/// Pairs of features that are tested. At least one must be set; to test nothing between two meshes, use
/// Scene::ignore_pair().
struct TestedFeatures {
  bool vertex_face = true;  ///< vertices against faces
  bool edge_edge = true;    ///< edges against edges
  bool operator==(const TestedFeatures&) const = default;
};

/// Options of one mesh.
struct MeshOptions {
  bool self_collision = true;  ///< whether contacts within the mesh are reported
  bool is_static = false;      ///< the mesh never moves; pairs of two static meshes are never tested
  /// Vertices in no face and no edge are points: tested against points and edges of no face too, not only against
  /// faces.
  bool points = false;
};

/// The half-space normal . x >= offset, bounded by a plane. The normal need not have unit length.
struct Plane {
  std::array<double, 3> normal{0, 0, 1};  ///< points into the half-space; not zero
  double offset = 0;                      ///< normal . x on the plane
  bool operator==(const Plane&) const = default;
};

/// Where a mesh with a shape is: a rotation of its shape, then a translation.
struct Pose {
  std::array<double, 3> position{0, 0, 0};       ///< translation, in units of the coordinates
  std::array<double, 4> quaternion{0, 0, 0, 1};  ///< rotation, x y z w; of length 1 within 1e-3, then normalised
};

/// Pairs of features of one mesh that are ignored because they were near each other at rest.
struct RestFilter {
  std::vector<double> vertices;  ///< x y z of each vertex of the mesh at rest
  double distance = 0;           ///< pairs within this distance are ignored
};

class ScenePairs;

/// Meshes of triangles and edges, with fixed topology. Vertices and faces of all meshes are numbered consecutively in
/// the order added. Positions passed to a Detector and indices in its results use this scene-wide numbering.
///
/// Mesh numbers count from 0 in the order added; an unknown number throws InvalidArgument. In functions of two meshes
/// the order of the numbers does not matter, and the same number twice means within that mesh.
///
/// Threads: a call that changes a scene must not run concurrently with other calls. An unchanging scene may be used by
/// any number of threads and detectors. Do not change a scene once a detector uses it.
class HPCCD_API Scene {
  friend class ScenePairs;  // internal: lists the values that are set for single pairs

 public:
  /// Adds a mesh and returns its number.
  ///
  /// - name: unique in the scene
  /// - faces: 3 indices per triangle into this mesh's own vertices, from 0 to n_vertices - 1
  /// - n_vertices: number of vertices of this mesh
  /// - options: self-collision, static
  /// - edges: 2 indices per edge, for edges that belong to no triangle, as of a rope. An edge that is given twice, or
  ///   that also belongs to a triangle, counts once; an edge from a vertex to itself is ignored.
  ///
  /// Throws InvalidArgument if the name is taken, if a length is not a multiple of 3 (or 2), if an index is out of
  /// range, or if the scene would have more than 2^32 - 2 vertices. On any exception the scene is unchanged.
  std::uint32_t add_mesh(std::string name, std::span<const std::uint32_t> faces, std::uint32_t n_vertices,
                         MeshOptions options = {}, std::span<const std::uint32_t> edges = {});

  /// Adds a plane and returns its number, counted together with the meshes. Vertices that are not in the half-space, or
  /// within the separation of its border, are in contact with it. A plane has no vertices. A static plane is not tested
  /// against static meshes. Throws InvalidArgument if the name is taken, or if a number is not finite or the normal
  /// zero.
  std::uint32_t add_plane(std::string name, const Plane& plane, bool is_static = true);

  /// Sets the thickness of a mesh: the separation of two features is that of their meshes plus the thickness of both.
  /// One value for all features, or one for each face. A mesh without faces has one for each edge, a mesh without both
  /// one for each vertex. Edges and vertices have the greatest thickness of the faces, or edges, that they are in.
  /// Throws InvalidArgument if the number of values is another one, or if a value is negative or not finite.
  void set_thickness(std::uint32_t mesh, std::span<const double> thickness);

  /// Sets the shape of a mesh that is moved by poses only: x y z of each of its vertices, for queries with poses
  /// (Detector::distances and others). A static mesh with a shape never leaves it. Throws InvalidArgument if the number
  /// of values is another one, if one is not finite or beyond 1e300, or for a plane.
  void set_shape(std::uint32_t mesh, std::span<const double> vertices);

  /// Ignores pairs of features of one mesh with vertices that are joined by at most `rings` edges. 0: pairs that share
  /// a vertex, which are always ignored. Of several calls the largest number counts.
  void ignore_within(std::uint32_t mesh, std::uint32_t rings);
  /// Ignores pairs of features of one mesh that are within a distance of each other at rest; repeated calls add to
  /// them. Each Detector of the scene finds them again, by a search for pairs at tier exact. Throws InvalidArgument
  /// unless `rest` has three finite coordinates per vertex of the mesh and the distance is finite and >= 0.
  void ignore_within(std::uint32_t mesh, RestFilter rest);
  /// Ignores some faces of a mesh, and those of their edges and vertices that are in no other face, against another
  /// mesh or plane, or against all of the mesh itself. `faces` are numbers of faces of the mesh; repeated calls add to
  /// them.
  void ignore_faces(std::uint32_t mesh, std::span<const std::uint32_t> faces, std::uint32_t other);
  /// Ignores single pairs of features: rows as in Contacts::vf, Contacts::ee and Intersections::ef, in scene-wide
  /// numbers; the vertices of an edge and the edges of a pair in any order. Repeated calls add to them. A Detector
  /// throws InvalidArgument if two vertices of a row are no edge.
  void ignore_features(std::span<const std::array<std::uint32_t, 2>> vf,
                       std::span<const std::array<std::uint32_t, 4>> ee,
                       std::span<const std::array<std::uint32_t, 3>> ef = {});

  /// Nothing is tested between the two meshes.
  void ignore_pair(std::uint32_t mesh_a, std::uint32_t mesh_b);
  /// Sets the accuracy between the two meshes, instead of Options::accuracy.
  void set_accuracy(std::uint32_t mesh_a, std::uint32_t mesh_b, Accuracy accuracy);
  /// Sets the minimum separation of the two meshes, instead of Options::minimum_separation, in units of the
  /// coordinates. Throws InvalidArgument unless it is finite and >= 0.
  void set_separation(std::uint32_t mesh_a, std::uint32_t mesh_b, double separation);
  /// Sets the features tested between the two meshes, instead of Options::features. Throws InvalidArgument if none is
  /// set.
  void set_features(std::uint32_t mesh_a, std::uint32_t mesh_b, TestedFeatures features);

  /// A mesh, and the place of its vertices, faces and edges in the scene-wide arrays.
  struct Mesh {
    std::string name;                           ///< as given to add_mesh
    MeshOptions options;                        ///< as given to add_mesh
    std::uint32_t first_vertex;                 ///< scene-wide number of its first vertex
    std::uint32_t n_vertices;                   ///< number of its vertices
    std::uint32_t first_face;                   ///< its first face in faces()
    std::uint32_t n_faces;                      ///< number of its faces
    std::uint32_t first_edge;                   ///< its first edge in edges()
    std::uint32_t n_edges;                      ///< number of its edges in edges()
    std::optional<Plane> plane = std::nullopt;  ///< as given to add_plane; its mesh has no vertices
    std::vector<double> thickness = {};         ///< as given to set_thickness; empty: zero
    /// As given to set_shape: its vertices are given by it, and by a pose unless the mesh is static. A mesh without
    /// vertices may have one too.
    std::optional<std::vector<double>> shape = std::nullopt;
  };
  /// All meshes, in the order added.
  const std::vector<Mesh>& meshes() const { return meshes_; }
  /// Vertices of the triangles of all meshes, scene-wide indices.
  const std::vector<std::array<std::uint32_t, 3>>& faces() const { return faces_; }
  /// Vertices of the edges that were given to add_mesh, scene-wide indices.
  const std::vector<std::array<std::uint32_t, 2>>& edges() const { return edges_; }
  /// Number of vertices of all meshes.
  std::uint32_t n_vertices() const { return n_vertices_; }

  // The value that is set for a pair of meshes, or `otherwise`. Mesh numbers are not checked.
  bool pair_enabled(std::uint32_t mesh_a, std::uint32_t mesh_b) const;
  Accuracy pair_accuracy(std::uint32_t mesh_a, std::uint32_t mesh_b, Accuracy otherwise) const;
  double pair_separation(std::uint32_t mesh_a, std::uint32_t mesh_b, double otherwise) const;
  TestedFeatures pair_features(std::uint32_t mesh_a, std::uint32_t mesh_b, TestedFeatures otherwise) const;

 private:
  using Pair = std::pair<std::uint32_t, std::uint32_t>;
  HPCCD_HIDDEN static Pair ordered(std::uint32_t a, std::uint32_t b) { return a < b ? Pair{a, b} : Pair{b, a}; }
  HPCCD_HIDDEN Pair known(std::uint32_t mesh_a, std::uint32_t mesh_b) const;
  std::vector<Mesh> meshes_;
  std::unordered_set<std::string> names_;
  std::vector<std::array<std::uint32_t, 3>> faces_;
  std::vector<std::array<std::uint32_t, 2>> edges_;
  std::uint32_t n_vertices_ = 0;
  std::map<Pair, bool> ignored_;
  std::map<Pair, Accuracy> accuracy_;
  std::map<Pair, double> separation_;
  std::map<Pair, TestedFeatures> features_;
  std::map<std::uint32_t, std::uint32_t> rings_;              // by mesh
  std::map<std::uint32_t, std::vector<RestFilter>> rest_;     // by mesh
  std::map<Pair, std::vector<std::uint32_t>> ignored_faces_;  // by mesh and other mesh, in this order
  std::vector<std::array<std::uint32_t, 2>> ignored_vf_;
  std::vector<std::array<std::uint32_t, 4>> ignored_ee_;
  std::vector<std::array<std::uint32_t, 3>> ignored_ef_;
};

}  // namespace v0_1
}  // namespace hpccd
