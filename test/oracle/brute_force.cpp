// SPDX-License-Identifier: Apache-2.0
#include "brute_force.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <map>

#include "distance.h"
#include "elementary.h"
#include "intersection.h"
#include "separation.h"

namespace oracle {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// The points of a pair's vertices, once for each set of positions.
template <class Query, class A, class B>
Query points_of(const A& a, const B& b, std::initializer_list<const std::vector<Point>*> positions) {
  Query query;
  std::size_t row = 0;
  for (const auto* vertices : positions) {
    for (const auto v : a) query[row++] = (*vertices)[v];
    for (const auto v : b) query[row++] = (*vertices)[v];
  }
  return query;
}

Pairs named(const std::vector<Edge>& edges, const std::vector<Found>& vf, const std::vector<Found>& ee) {
  Pairs pairs;
  for (const Found& found : vf) {
    pairs.vf.push_back({static_cast<std::uint32_t>(found.first), static_cast<std::uint32_t>(found.second)});
    pairs.vf_value.push_back(found.value);
  }
  for (const Found& found : ee) {
    const Edge &a = edges[found.first], &b = edges[found.second];
    pairs.ee.push_back({a[0], a[1], b[0], b[1]});
    pairs.ee_value.push_back(found.value);
  }
  return pairs;
}

template <class A, class B>
std::vector<Found> intersecting(const Meshes& meshes, const Features<A>& edges, const Features<B>& faces,
                                const std::vector<Point>& vertices, unsigned threads) {
  const auto touching = [](auto, auto) { return 0.0; };
  return all_pairs(meshes, edges, faces, touching, threads, [&](const A& a, const B& b) -> std::optional<double> {
    if (!edge_face_intersect(points_of<std::array<Point, 5>>(a, b, {&vertices}))) return {};
    return 0.0;
  });
}

}  // namespace

Pairs contacts(const Meshes& meshes, const std::vector<Point>& t0, const std::vector<Point>& t1,
               const Separations& separations, unsigned threads) {
  const auto reach = [&](std::uint32_t a, std::uint32_t b) { return separations[a][b]; };
  const auto vertices = with_boxes(vertices_of(meshes), t0, t1);
  const auto edges = with_boxes(edges_of(meshes), t0, t1);
  const auto faces = with_boxes(meshes.faces, t0, t1);
  const auto time = [&](const auto& a, const auto& b, auto plain, auto separated) {
    const auto query = points_of<Query>(a, b, {&t0, &t1});
    const double d = separations[meshes.mesh_of(a[0])][meshes.mesh_of(b[0])];
    return d == 0 ? plain(query) : separated(query, d);
  };
  const auto vf = all_pairs(meshes, vertices, faces, reach, threads, [&](const Vertex& v, const Face& f) {
    return time(v, f, vertex_face, separation_vertex_face);
  });
  const auto ee = all_pairs(meshes, edges, edges, reach, threads,
                            [&](const Edge& a, const Edge& b) { return time(a, b, edge_edge, separation_edge_edge); });
  return named(edges.list, vf, ee);
}

Pairs proximity(const Meshes& meshes, const std::vector<Point>& positions, double distance, unsigned threads) {
  const auto reach = [&](std::uint32_t, std::uint32_t) { return distance; };
  const auto vertices = with_boxes(vertices_of(meshes), positions, positions);
  const auto edges = with_boxes(edges_of(meshes), positions, positions);
  const auto faces = with_boxes(meshes.faces, positions, positions);
  const auto near = [&](const auto& a, const auto& b, auto within, auto exactly) -> std::optional<double> {
    const auto points = points_of<Points>(a, b, {&positions});
    if (distance < infinity && !within(points, distance)) return {};
    return exactly(points);
  };
  const auto vf = all_pairs(meshes, vertices, faces, reach, threads, [&](const Vertex& v, const Face& f) {
    return near(v, f, within_vertex_face, distance_vertex_face);
  });
  const auto ee = all_pairs(meshes, edges, edges, reach, threads, [&](const Edge& a, const Edge& b) {
    return near(a, b, within_edge_edge, distance_edge_edge);
  });
  return named(edges.list, vf, ee);
}

std::vector<std::array<std::uint32_t, 3>> intersections(const Meshes& meshes, const std::vector<Point>& positions,
                                                        unsigned threads) {
  const auto edges = with_boxes(edges_of(meshes), positions, positions);
  const auto faces = with_boxes(meshes.faces, positions, positions);
  std::vector<std::array<std::uint32_t, 3>> rows;
  for (const Found& found : intersecting(meshes, edges, faces, positions, threads)) {
    const Edge& e = edges.list[found.first];
    rows.push_back({e[0], e[1], static_cast<std::uint32_t>(found.second)});
  }
  return rows;
}

std::vector<Gap> smallest_distances(const Meshes& meshes, const std::vector<Point>& positions, unsigned threads) {
  std::vector<Gap> gaps;
  std::map<std::array<std::uint32_t, 2>, std::size_t> place;
  for (std::uint32_t a = 0; a < meshes.tested.size(); ++a)
    for (std::uint32_t b = a; b < meshes.tested.size(); ++b)
      if (meshes.tested[a][b]) {
        place[{a, b}] = gaps.size();
        gaps.push_back({a, b, infinity, false});
      }
  const auto gap_of = [&](std::uint32_t v, std::uint32_t w) -> Gap& {
    const auto [a, b] = std::minmax({meshes.mesh_of(v), meshes.mesh_of(w)});
    return gaps[place.at({a, b})];
  };
  // Rounding keeps the order: the smallest of the rounded distances is the smallest distance, rounded.
  const Pairs all = proximity(meshes, positions, infinity, threads);
  for (std::size_t i = 0; i < all.vf.size(); ++i) {
    Gap& gap = gap_of(all.vf[i][0], meshes.faces[all.vf[i][1]][0]);
    gap.distance = std::min(gap.distance, all.vf_value[i]);
  }
  for (std::size_t i = 0; i < all.ee.size(); ++i) {
    Gap& gap = gap_of(all.ee[i][0], all.ee[i][2]);
    gap.distance = std::min(gap.distance, all.ee_value[i]);
  }
  for (const auto& [v0, v1, face] : intersections(meshes, positions, threads)) {
    Gap& gap = gap_of(v0, meshes.faces[face][0]);
    gap.distance = 0;
    gap.intersect = true;
  }
  return gaps;
}

}  // namespace oracle
