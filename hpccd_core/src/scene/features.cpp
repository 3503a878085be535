// SPDX-License-Identifier: Apache-2.0
#include "scene/features.h"

#include <algorithm>
#include <utility>

#include "scene/edges.h"

namespace hpccd {
namespace {

// Lists the features of each primitive, from each feature's owner (ascending within a primitive).
void group_by_owner(const std::vector<std::uint32_t>& owner, std::size_t n_primitives,
                    std::vector<std::uint32_t>& first, std::vector<std::uint32_t>& owned) {
  first.assign(n_primitives + 1, 0);
  for (std::uint32_t c : owner) ++first[c + 1];
  for (std::size_t c = 0; c < n_primitives; ++c) first[c + 1] += first[c];
  owned.resize(owner.size());
  std::vector<std::uint32_t> next(first.begin(), first.end() - 1);
  for (std::uint32_t i = 0; i < owner.size(); ++i) owned[next[owner[i]]++] = i;
}

// Adds the edges from points to themselves.
void add_points(Features& x, const Scene& scene, std::vector<std::uint32_t>& owner) {
  std::vector<std::pair<std::array<std::uint32_t, 2>, std::uint32_t>> points;
  for (std::uint32_t i = 0; i < x.lone_vertices.size(); ++i)
    if (const std::uint32_t v = x.lone_vertices[i]; scene.meshes()[x.mesh_of_vertex[v]].options.points)
      points.push_back({{v, v}, x.first_lone_vertex() + i});
  if (points.empty()) return;
  std::vector<std::array<std::uint32_t, 2>> edges;
  std::vector<std::uint32_t> owners;
  edges.reserve(x.edges.size() + points.size()), owners.reserve(x.edges.size() + points.size());
  for (std::size_t i = 0, j = 0; i < x.edges.size() || j < points.size();) {
    const bool from_points = i == x.edges.size() || (j < points.size() && points[j].first < x.edges[i]);
    edges.push_back(from_points ? points[j].first : x.edges[i]);
    owners.push_back(from_points ? points[j].second : owner[i]);
    ++(from_points ? j : i);
  }
  x.edges = std::move(edges), owner = std::move(owners);
  x.edge_kinds_of_mesh.resize(scene.meshes().size());
  for (std::size_t e = 0; e < x.edges.size(); ++e) {
    const EdgeKind kind = owner[e] < x.n_faces()             ? EdgeKind::of_face
                          : owner[e] < x.first_lone_vertex() ? EdgeKind::lone
                                                             : EdgeKind::point;
    x.edge_kinds.push_back(kind);
    x.edge_kinds_of_mesh[x.mesh_of_vertex[x.edges[e][0]]] |=
        static_cast<unsigned char>(1u << static_cast<unsigned>(kind));
  }
}

}  // namespace

Features features_of(const Scene& scene, ThreadPool& pool) {
  Features x;
  x.faces = scene.faces();
  x.n_vertices = scene.n_vertices();
  std::vector<std::uint32_t> vertex_owner(x.n_vertices, UINT32_MAX);
  Edges edges = find_edges(x, pool, vertex_owner);
  x.lone_edges = lone_edges(scene.edges(), edges);
  edges = with_lone_edges(std::move(edges), x.lone_edges, x.first_lone_edge());
  x.edges = std::move(edges.edges);
  for (std::uint32_t i = 0; i < x.lone_edges.size(); ++i)
    for (const std::uint32_t v : x.lone_edges[i]) vertex_owner[v] = std::min(vertex_owner[v], x.first_lone_edge() + i);
  for (std::uint32_t v = 0; v < x.n_vertices; ++v)
    if (vertex_owner[v] == UINT32_MAX) {
      vertex_owner[v] = x.first_lone_vertex() + static_cast<std::uint32_t>(x.lone_vertices.size());
      x.lone_vertices.push_back(v);
    }

  x.mesh_of_primitive.resize(x.first_lone_vertex() + x.lone_vertices.size());
  x.mesh_of_vertex.resize(x.n_vertices);
  for (std::uint32_t m = 0; m < scene.meshes().size(); ++m) {
    const auto& mesh = scene.meshes()[m];
    std::fill_n(x.mesh_of_primitive.begin() + mesh.first_face, mesh.n_faces, m);
    std::fill_n(x.mesh_of_vertex.begin() + mesh.first_vertex, mesh.n_vertices, m);
  }
  for (std::size_t i = 0; i < x.lone_edges.size(); ++i)
    x.mesh_of_primitive[x.first_lone_edge() + i] = x.mesh_of_vertex[x.lone_edges[i][0]];
  for (std::size_t i = 0; i < x.lone_vertices.size(); ++i)
    x.mesh_of_primitive[x.first_lone_vertex() + i] = x.mesh_of_vertex[x.lone_vertices[i]];
  add_points(x, scene, edges.owner);
  parallel_for_each(pool, 2, [&](std::size_t i) {
    if (i == 0)
      group_by_owner(edges.owner, x.n_primitives(), x.first_edge, x.owned_edges);
    else
      group_by_owner(vertex_owner, x.n_primitives(), x.first_vertex, x.owned_vertices);
  });
  return x;
}

Features features_of(const Scene& scene) {
  ThreadPool alone(1);
  return features_of(scene, alone);
}

}  // namespace hpccd
