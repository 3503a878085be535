// SPDX-License-Identifier: Apache-2.0
#include "all_pairs.h"

namespace oracle {

std::vector<Vertex> vertices_of(const Meshes& meshes) {
  std::vector<Vertex> vertices;
  for (std::uint32_t v = 0; v < meshes.mesh_of_vertex.size(); ++v) vertices.push_back({v});
  return vertices;
}

std::vector<Edge> edges_of(const Meshes& meshes) {
  std::vector<Edge> edges;
  const auto add = [&](const Edge& e) {
    if (e[0] != e[1]) edges.push_back({std::min(e[0], e[1]), std::max(e[0], e[1])});
  };
  for (const Face& f : meshes.faces)
    for (const Edge& e : {Edge{f[0], f[1]}, Edge{f[1], f[2]}, Edge{f[2], f[0]}}) add(e);
  for (const Edge& e : meshes.edges) add(e);
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  return edges;
}

bool farther_apart(const Box& a, const Box& b, double distance) {
  // A difference of doubles is off by at most 2^-53 of itself: exact where it is as small as denormal numbers.
  const double beyond = distance * (1 + 0x1p-50);
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (b.low[axis] - a.high[axis] > beyond || a.low[axis] - b.high[axis] > beyond) return true;
  return false;
}

}  // namespace oracle
