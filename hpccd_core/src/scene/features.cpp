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
