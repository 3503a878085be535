// SPDX-License-Identifier: Apache-2.0
#include "backends/rest_pairs.h"

#include <algorithm>
#include <span>

#include "backends/cpu_backend.h"
#include "scene/face_adjacency.h"
#include "scene/scene_pairs.h"

namespace hpccd {
namespace {

// One mesh as a scene of its own, with its features numbered from 0: both scenes order them alike.
class MeshAtRest {
 public:
  MeshAtRest(const Scene& scene, std::uint32_t mesh, const Features& features, int threads)
      : mesh_(scene.meshes()[mesh]),
        first_edge_(edges_of_mesh(features, mesh_)[0]),
        common_(alone(scene, mesh_), {}, threads),
        resources_(common_, common_.pool),
        backend_(resources_),
        adjacency_(common_.features.faces, common_.features.n_vertices),
        edges_of_vertex_(common_.features.n_vertices) {
    const auto& edges = common_.features.edges;
    for (std::uint32_t i = 0; i < edges.size(); ++i)
      for (const std::uint32_t v : edges[i]) edges_of_vertex_[v].push_back(i);
  }

  void add_to(FeaturePairs& pairs, const RestFilter& rest) {
    const Positions vertices{rest.vertices.data(), mesh_.n_vertices, true};
    const Contacts near = *backend_.proximity(vertices, rest.distance);
    for (const auto& [v, face] : near.vf) {
      pairs.vf.push_back({mesh_.first_vertex + v, mesh_.first_face + face});
      for (const std::uint32_t edge : edges_of_vertex_[v]) add_edge_face(pairs, edge, face);
    }
    const auto add_edges = [&](std::array<std::uint32_t, 2> ends_a, std::array<std::uint32_t, 2> ends_b) {
      const std::uint32_t a = number(ends_a), b = number(ends_b);
      pairs.ee.push_back({first_edge_ + a, first_edge_ + b});
      adjacency_.for_each_face(ends_b[0], ends_b[1], [&](std::uint32_t face) { add_edge_face(pairs, a, face); });
      adjacency_.for_each_face(ends_a[0], ends_a[1], [&](std::uint32_t face) { add_edge_face(pairs, b, face); });
    };
    for (const auto& [a0, a1, b0, b1] : near.ee) add_edges({a0, a1}, {b0, b1});
    for (const auto& [v, w] : near.vv) add_edges({v, v}, {w, w});
    for (const auto& [v, a, b] : near.ve) add_edges({v, v}, {a, b});
    // The distance of an edge and a face that do not intersect is that of an end and the face, or of the edge and an
    // edge of the face: those pairs are above.
    const Intersections touching = *backend_.intersections(vertices);
    for (const auto& [a, b, face] : touching.ef) add_edge_face(pairs, number({a, b}), face);
  }

 private:
  static std::shared_ptr<const Scene> alone(const Scene& scene, const Scene::Mesh& mesh) {
    std::vector<std::uint32_t> faces, edges;
    const auto append = [&](std::vector<std::uint32_t>& to, const auto& from) {
      for (const auto& feature : from)
        for (const std::uint32_t v : feature) to.push_back(v - mesh.first_vertex);
    };
    append(faces, std::span(scene.faces()).subspan(mesh.first_face, mesh.n_faces));
    append(edges, std::span(scene.edges()).subspan(mesh.first_edge, mesh.n_edges));
    const auto own = std::make_shared<Scene>();
    MeshOptions options;
    options.points = mesh.options.points;
    own->add_mesh(mesh.name, faces, mesh.n_vertices, options, edges);
    return own;
  }
  std::uint32_t number(std::array<std::uint32_t, 2> ends) const {
    const auto& edges = common_.features.edges;
    return static_cast<std::uint32_t>(std::ranges::lower_bound(edges, ends) - edges.begin());
  }
  void add_edge_face(FeaturePairs& pairs, std::uint32_t edge, std::uint32_t face) const {
    const auto& f = common_.features.faces[face];
    for (const std::uint32_t v : common_.features.edges[edge])
      if (v == f[0] || v == f[1] || v == f[2]) return;  // never tested
    pairs.ef.push_back({first_edge_ + edge, mesh_.first_face + face});
  }

  const Scene::Mesh& mesh_;
  const std::uint32_t first_edge_;
  Common common_;
  Resources resources_;
  CpuBackend backend_;
  FaceAdjacency adjacency_;
  std::vector<std::vector<std::uint32_t>> edges_of_vertex_;
};

}  // namespace

FeaturePairs pairs_at_rest(const Scene& scene, const Features& features, int threads) {
  FeaturePairs pairs;
  for (const auto& [mesh, filters] : ScenePairs(scene).rest()) {
    if (!scene.pair_enabled(mesh, mesh)) continue;
    MeshAtRest alone(scene, mesh, features, threads);
    for (const RestFilter& rest : filters) alone.add_to(pairs, rest);
  }
  return pairs;
}

}  // namespace hpccd
