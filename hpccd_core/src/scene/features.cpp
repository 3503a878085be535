// SPDX-License-Identifier: Apache-2.0
#include "scene/features.h"

#include <algorithm>

namespace hpccd {
namespace {

struct Side {
  std::array<std::uint32_t, 2> edge;
  std::uint32_t face;
  auto operator<=>(const Side&) const = default;
};

// Lists of what each carrier owns, from each thing's owner (ascending within a carrier).
void group_by_owner(const std::vector<std::uint32_t>& owner, std::size_t n_carriers, std::vector<std::uint32_t>& first,
                    std::vector<std::uint32_t>& owned) {
  first.assign(n_carriers + 1, 0);
  for (std::uint32_t c : owner) ++first[c + 1];
  for (std::size_t c = 0; c < n_carriers; ++c) first[c + 1] += first[c];
  owned.resize(owner.size());
  std::vector<std::uint32_t> next(first.begin(), first.end() - 1);
  for (std::uint32_t i = 0; i < owner.size(); ++i) owned[next[owner[i]]++] = i;
}

}  // namespace

Features features_of(const Scene& scene) {
  Features x;
  x.faces = scene.faces();
  x.n_vertices = scene.n_vertices();
  std::vector<Side> sides;
  sides.reserve(3 * x.faces.size());
  std::vector<std::uint32_t> vertex_owner(x.n_vertices, UINT32_MAX);
  for (std::uint32_t f = 0; f < x.faces.size(); ++f)
    for (int i = 0; i < 3; ++i) {
      const std::uint32_t v = x.faces[f][i], w = x.faces[f][(i + 1) % 3];
      if (vertex_owner[v] == UINT32_MAX) vertex_owner[v] = f;
      if (v != w) sides.push_back({{std::min(v, w), std::max(v, w)}, f});
    }
  std::sort(sides.begin(), sides.end());
  std::vector<std::uint32_t> edge_owner;
  for (const Side& s : sides)
    if (x.edges.empty() || x.edges.back() != s.edge) {
      x.edges.push_back(s.edge);
      edge_owner.push_back(s.face);
    }
  for (std::uint32_t v = 0; v < x.n_vertices; ++v)
    if (vertex_owner[v] == UINT32_MAX) {
      vertex_owner[v] = x.n_faces() + static_cast<std::uint32_t>(x.lone_vertices.size());
      x.lone_vertices.push_back(v);
    }

  x.mesh_of_carrier.resize(x.faces.size() + x.lone_vertices.size());
  for (std::uint32_t m = 0; m < scene.meshes().size(); ++m) {
    const auto& mesh = scene.meshes()[m];
    std::fill_n(x.mesh_of_carrier.begin() + mesh.first_face, mesh.n_faces, m);
    for (std::size_t i = 0; i < x.lone_vertices.size(); ++i)
      if (x.lone_vertices[i] >= mesh.first_vertex && x.lone_vertices[i] - mesh.first_vertex < mesh.n_vertices)
        x.mesh_of_carrier[x.faces.size() + i] = m;
  }
  group_by_owner(edge_owner, x.n_carriers(), x.first_edge, x.owned_edges);
  group_by_owner(vertex_owner, x.n_carriers(), x.first_vertex, x.owned_vertices);
  return x;
}

}  // namespace hpccd
