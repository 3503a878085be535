// SPDX-License-Identifier: Apache-2.0
#include "brute_force.h"

#include <algorithm>
#include <cstddef>

#include "elementary.h"
#include "parallel.h"

namespace hpccd::reference {
namespace {

// Box of a feature's vertices at both ends of the step. A vertex on a straight line stays in the box of its
// two ends and a feature in the box of its vertices; minima and maxima do not round: disjoint boxes prove
// that nothing touches.
struct Box {
  Point low, high;
};

template <class Vertices>
Box swept_box(const Scene& scene, const Vertices& vertices) {
  Box box{scene.vertices_t0[vertices[0]], scene.vertices_t0[vertices[0]]};
  for (const std::uint32_t v : vertices)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto [low, high] = std::minmax(scene.vertices_t0[v][axis], scene.vertices_t1[v][axis]);
      box.low[axis] = std::min(box.low[axis], low);
      box.high[axis] = std::max(box.high[axis], high);
    }
  return box;
}

bool disjoint(const Box& a, const Box& b) {
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (a.high[axis] < b.low[axis] || b.high[axis] < a.low[axis]) return true;
  return false;
}

template <class A, class B>
bool share_a_vertex(const A& a, const B& b) {
  return std::any_of(a.begin(), a.end(), [&](auto v) { return std::find(b.begin(), b.end(), v) != b.end(); });
}

template <class A, class B>
Query query_of(const Scene& scene, const A& a, const B& b) {
  Query query;
  std::size_t row = 0;
  for (const auto* vertices : {&scene.vertices_t0, &scene.vertices_t1}) {
    for (const auto v : a) query[row++] = (*vertices)[v];
    for (const auto v : b) query[row++] = (*vertices)[v];
  }
  return query;
}

std::vector<Edge> edges_of(const std::vector<Face>& faces) {
  std::vector<Edge> edges;
  for (const Face& f : faces)
    for (const Edge e : {Edge{f[0], f[1]}, Edge{f[1], f[2]}, Edge{f[2], f[0]}})
      if (e[0] != e[1]) edges.push_back({std::min(e[0], e[1]), std::max(e[0], e[1])});
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  return edges;
}

template <class Feature>
std::vector<Box> boxes_of(const Scene& scene, const std::vector<Feature>& features) {
  std::vector<Box> boxes;
  for (const Feature& feature : features) boxes.push_back(swept_box(scene, feature));
  return boxes;
}

struct Hit {
  std::size_t partner;
  double toc;
};

}  // namespace

Contacts brute_force(const Scene& scene, unsigned threads) {
  const auto asked_for = [&](std::uint32_t v, std::uint32_t w) {
    return scene.tested[scene.mesh_of_vertex[v]][scene.mesh_of_vertex[w]] != 0;
  };
  Contacts contacts;

  const std::vector<Box> face_boxes = boxes_of(scene, scene.faces);
  std::vector<std::vector<Hit>> faces_hit(scene.vertices_t0.size());
  parallel_for(faces_hit.size(), threads, [&](std::size_t i) {
    const std::array<std::uint32_t, 1> vertex{static_cast<std::uint32_t>(i)};
    const Box box = swept_box(scene, vertex);
    for (std::size_t f = 0; f < scene.faces.size(); ++f) {
      const Face& face = scene.faces[f];
      if (disjoint(box, face_boxes[f]) || share_a_vertex(vertex, face) || !asked_for(vertex[0], face[0])) continue;
      if (const auto toc = vertex_face(query_of(scene, vertex, face))) faces_hit[i].push_back({f, *toc});
    }
  });
  for (std::size_t i = 0; i < faces_hit.size(); ++i)
    for (const Hit& hit : faces_hit[i]) {
      contacts.vf.push_back({static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(hit.partner)});
      contacts.vf_toc.push_back(hit.toc);
    }

  const std::vector<Edge> edges = edges_of(scene.faces);
  const std::vector<Box> edge_boxes = boxes_of(scene, edges);
  std::vector<std::vector<Hit>> edges_hit(edges.size());
  parallel_for(edges.size(), threads, [&](std::size_t a) {
    for (std::size_t b = a + 1; b < edges.size(); ++b) {
      if (disjoint(edge_boxes[a], edge_boxes[b]) || share_a_vertex(edges[a], edges[b]) ||
          !asked_for(edges[a][0], edges[b][0]))
        continue;
      if (const auto toc = edge_edge(query_of(scene, edges[a], edges[b]))) edges_hit[a].push_back({b, *toc});
    }
  });
  for (std::size_t a = 0; a < edges.size(); ++a)
    for (const Hit& hit : edges_hit[a]) {
      const Edge &e = edges[a], &f = edges[hit.partner];
      contacts.ee.push_back({e[0], e[1], f[0], f[1]});
      contacts.ee_toc.push_back(hit.toc);
    }
  return contacts;
}

}  // namespace hpccd::reference
