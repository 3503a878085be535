// SPDX-License-Identifier: Apache-2.0
// Which meshes there are, and which pairs of them matter.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <unordered_set>
#include <utility>
#include <vector>

#include "hpccd/export.h"

namespace hpccd {
inline namespace v0_1 {

/// What an answer promises:
///   exact         yes or no as rational arithmetic on the given coordinates; times within 1e-12
///   conservative  none missed, no time later than it is
///   balanced      double precision; in doubt only within about 1e-12 of a border
///   fast          single precision; no promise, times mostly to 1e-3 of the step
enum class Accuracy : std::uint8_t { fast, balanced, conservative, exact };

/// Which pairs of features are tested at all. To test neither is refused: Scene::ignore_pair() says that of two meshes.
struct TestedFeatures {
  bool vertex_face = true;
  bool edge_edge = true;
  bool operator==(const TestedFeatures&) const = default;
};

struct MeshOptions {
  bool self_collision = true;
  bool is_static = false;  ///< promised not to move; pairs of two static meshes are never tested
};

class ScenePairs;

/// Meshes of triangles and of edges alone, with their topology. The vertices of all meshes are numbered one after the
/// other, in the order added: so stand their positions in what a Detector is given, and so count the indices in its
/// answers.
///
/// Mesh numbers count from 0 in the order added; a number that no mesh has is refused (InvalidArgument). Where two
/// numbers are asked for, their order does not matter, and the same number twice means within that mesh.
///
/// Threads: calls that change a scene need it alone. One that no longer changes may serve any number of threads and
/// detectors. A detector reads its scene when it is made and later: do not change it from then on.
class HPCCD_API Scene {
  friend class ScenePairs;  // internal: lists the values set for single pairs

 public:
  /// Adds a mesh and returns its number.
  /// name: one that no other mesh has. faces: 3 indices a triangle into this mesh's own vertices, [0, n_vertices).
  /// edges: 2 indices each, likewise: those beside the triangles' own, as of a rope or a rod. One that is given twice,
  /// or is a triangle's too, counts once; one from a vertex to itself is none.
  /// Throws InvalidArgument for a name that is taken, a length that is no multiple of 3 (2), an index out of range (it
  /// says which), and where the scene would have more than 2^32 - 2 vertices. Whatever is thrown, the scene is as it
  /// was.
  std::uint32_t add_mesh(std::string name, std::span<const std::uint32_t> faces, std::uint32_t n_vertices,
                         MeshOptions options = {}, std::span<const std::uint32_t> edges = {});

  /// Nothing is tested between the two.
  void ignore_pair(std::uint32_t mesh_a, std::uint32_t mesh_b);
  /// The accuracy of what is tested between the two, instead of Options::accuracy.
  void set_accuracy(std::uint32_t mesh_a, std::uint32_t mesh_b, Accuracy accuracy);
  /// How far apart the two shall stay, in units of the coordinates, instead of Options::minimum_separation. Finite, >=
  /// 0, else InvalidArgument.
  void set_separation(std::uint32_t mesh_a, std::uint32_t mesh_b, double separation);
  /// What is tested between the two, instead of Options::features. InvalidArgument where that is nothing.
  void set_features(std::uint32_t mesh_a, std::uint32_t mesh_b, TestedFeatures features);

  struct Mesh {
    std::string name;
    MeshOptions options;
    std::uint32_t first_vertex, n_vertices, first_face, n_faces;
    std::uint32_t first_edge, n_edges;  ///< in edges()
  };
  const std::vector<Mesh>& meshes() const { return meshes_; }
  /// Vertices of each triangle of all meshes, as numbered in the scene.
  const std::vector<std::array<std::uint32_t, 3>>& faces() const { return faces_; }
  /// Ends of each edge that was given, of all meshes, as numbered in the scene.
  const std::vector<std::array<std::uint32_t, 2>>& edges() const { return edges_; }
  std::uint32_t n_vertices() const { return n_vertices_; }

  // What was set of a pair, or what holds otherwise. Numbers are not checked here.
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
};

}  // namespace v0_1
}  // namespace hpccd
