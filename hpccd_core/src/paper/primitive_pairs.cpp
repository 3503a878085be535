// SPDX-License-Identifier: Apache-2.0
#include "paper/primitive_pairs.h"

#include "bvh/primitive_box.h"

namespace hpccd::paper {
namespace {

void append(CandidateBuffer& buffer, std::uint32_t first, std::uint32_t second) {
  buffer.first[buffer.n] = first;
  buffer.second[buffer.n++] = second;
}

void edge_pairs(const Features& features, const std::vector<Box>& vertex_boxes, BoundedPrimitive a, BoundedPrimitive b,
                CandidateBuffer& out) {
  struct BoundedEdge {
    std::uint32_t number;
    std::array<std::uint32_t, 2> ends;
    Box box;
  };
  const auto near = [&](std::uint32_t number, const Box& other, BoundedEdge& e) {
    e.number = number;
    e.ends = features.edges[number];
    e.box = vertex_boxes[e.ends[0]];
    e.box.include(vertex_boxes[e.ends[1]]);
    return e.box.overlaps(other);
  };
  BoundedEdge of_b[3];
  int n_b = 0;
  for (auto i = features.first_edge[b.number]; i < features.first_edge[b.number + 1]; ++i)
    n_b += near(features.owned_edges[i], a.box, of_b[n_b]);
  if (n_b == 0) return;
  for (auto i = features.first_edge[a.number]; i < features.first_edge[a.number + 1]; ++i) {
    BoundedEdge x;
    if (!near(features.owned_edges[i], b.box, x)) continue;
    for (int j = 0; j < n_b; ++j) {
      const BoundedEdge& y = of_b[j];
      const bool share =
          x.ends[0] == y.ends[0] || x.ends[0] == y.ends[1] || x.ends[1] == y.ends[0] || x.ends[1] == y.ends[1];
      if (!share && x.box.overlaps(y.box)) append(out, std::min(x.number, y.number), std::max(x.number, y.number));
    }
  }
}

void vertex_face_pairs(const Features& features, const std::vector<Box>& vertex_boxes, BoundedPrimitive vertices,
                       BoundedPrimitive face, CandidateBuffer& out) {
  if (face.number >= features.n_faces()) return;  // an edge or a vertex that is in no triangle
  const auto& corners = features.faces[face.number];
  for (auto i = features.first_vertex[vertices.number]; i < features.first_vertex[vertices.number + 1]; ++i) {
    const std::uint32_t v = features.owned_vertices[i];
    const bool share = v == corners[0] || v == corners[1] || v == corners[2];
    if (!share && vertex_boxes[v].overlaps(face.box)) append(out, v, face.number);
  }
}

}  // namespace

void primitive_pairs(const Features& features, const std::vector<Box>& vertex_boxes, BoundedPrimitive a,
                     BoundedPrimitive b, TestedFeatures tested, CandidateBuffer& edge_edge,
                     CandidateBuffer& vertex_face) {
  if (tested.edge_edge) edge_pairs(features, vertex_boxes, a, b, edge_edge);
  if (!tested.vertex_face) return;
  vertex_face_pairs(features, vertex_boxes, a, b, vertex_face);
  vertex_face_pairs(features, vertex_boxes, b, a, vertex_face);
}

void test_primitives(const Features& features, const PairRules& rules, const std::vector<Box>& vertex_boxes,
                     LeafPair primitives, Worker& worker) {
  const Box a = primitive_box(features, vertex_boxes, primitives.first),
            b = primitive_box(features, vertex_boxes, primitives.second);
  const auto& mesh = features.mesh_of_primitive;
  test_primitives(features, rules.rule(mesh[primitives.first], mesh[primitives.second]), vertex_boxes,
                  {primitives.first, a}, {primitives.second, b}, worker);
}

}  // namespace hpccd::paper
