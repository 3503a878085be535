// SPDX-License-Identifier: Apache-2.0
#include "scene/features.h"

#include <algorithm>
#include <numeric>

namespace hpccd {
namespace {

// A triangle's side, seen from its vertex with the lower number.
struct Side {
  std::uint32_t higher, face;
  auto operator<=>(const Side&) const = default;
};

// Calls use(lower vertex, side) for every side of every triangle.
template <class Use>
void for_each_side(const Features& x, Use&& use) {
  for (std::uint32_t f = 0; f < x.faces.size(); ++f)
    for (int i = 0; i < 3; ++i) {
      const std::uint32_t v = x.faces[f][i], w = x.faces[f][(i + 1) % 3];
      if (v != w) use(std::min(v, w), Side{std::max(v, w), f});
    }
}

// Edges in lexicographic order, each with the first triangle that has it: a counting sort by the lower vertex, then a
// sort of the few sides of each.
std::vector<std::uint32_t> find_edges(Features& x) {
  std::vector<std::uint32_t> first(std::size_t{x.n_vertices} + 1, 0);
  for_each_side(x, [&](std::uint32_t v, Side) { ++first[v + 1]; });
  std::partial_sum(first.begin(), first.end(), first.begin());
  std::vector<Side> sides(first.back());
  std::vector<std::uint32_t> next(first.begin(), first.end() - 1);
  for_each_side(x, [&](std::uint32_t v, Side side) { sides[next[v]++] = side; });
  std::vector<std::uint32_t> owner;
  x.edges.reserve(sides.size() / 2 + 1);
  owner.reserve(sides.size() / 2 + 1);
  for (std::uint32_t v = 0; v < x.n_vertices; ++v) {
    std::sort(sides.begin() + first[v], sides.begin() + first[v + 1]);
    for (std::uint32_t i = first[v]; i < first[v + 1]; ++i) {
      if (i > first[v] && sides[i].higher == sides[i - 1].higher) continue;
      x.edges.push_back({v, sides[i].higher});
      owner.push_back(sides[i].face);
    }
  }
  return owner;
}

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
  const std::vector<std::uint32_t> edge_owner = find_edges(x);
  std::vector<std::uint32_t> vertex_owner(x.n_vertices, UINT32_MAX);
  for (std::uint32_t f = x.n_faces(); f-- > 0;)
    for (std::uint32_t v : x.faces[f]) vertex_owner[v] = f;
  for (std::uint32_t v = 0; v < x.n_vertices; ++v)
    if (vertex_owner[v] == UINT32_MAX) {
      vertex_owner[v] = x.n_faces() + static_cast<std::uint32_t>(x.lone_vertices.size());
      x.lone_vertices.push_back(v);
    }

  x.mesh_of_carrier.resize(x.faces.size() + x.lone_vertices.size());
  for (std::uint32_t m = 0; m < scene.meshes().size(); ++m) {
    const auto& mesh = scene.meshes()[m];
    std::fill_n(x.mesh_of_carrier.begin() + mesh.first_face, mesh.n_faces, m);
    const auto end = std::ranges::lower_bound(x.lone_vertices, mesh.first_vertex + mesh.n_vertices);
    for (auto v = std::ranges::lower_bound(x.lone_vertices, mesh.first_vertex); v < end; ++v)
      x.mesh_of_carrier[x.faces.size() + static_cast<std::size_t>(v - x.lone_vertices.begin())] = m;
  }
  group_by_owner(edge_owner, x.n_carriers(), x.first_edge, x.owned_edges);
  group_by_owner(vertex_owner, x.n_carriers(), x.first_vertex, x.owned_vertices);
  return x;
}

}  // namespace hpccd
