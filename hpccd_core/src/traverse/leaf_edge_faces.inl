// SPDX-License-Identifier: Apache-2.0
// Included once per instruction set, after its header (base/simd/scalar.h), on the terms of leaf_pairs.inl.

#include "traverse/leaf_edge_faces.h"

namespace hpccd::HPCCD_ISA {
namespace {

#include "traverse/leaf_boxes.inl"

// Edges of a against faces of b: one by one the faces, of which a leaf has fewer, in groups the edges.
HPCCD_HD void edges_against_faces(const Tree& tree, const LeafRange& a, const LeafRange& b, const Node& node_a,
                                  const Node& node_b, CandidateBuffer& out) {
  const std::uint32_t n_edges = a.n_edges(), n_faces = b.n_faces();
  if (!n_edges || !n_faces) return;
  const LeafCorners corners_a(tree, a), corners_b(tree, b);
  static_assert(Tree::leaf_size <= BoxGroup::width);
  constexpr InSnapshot when{0};
  const FaceBoxes face_boxes(corners_b);
  const unsigned near_faces =
      when.overlapping(when.load(face_boxes.group), bounds_of(node_a)) & lanes_in(0, 0, n_faces);
  if (!near_faces) return;
  const EdgeBoxes edge_boxes(corners_a, n_edges);
  const EdgeEnds ends(corners_a, corners_a.of->edge, n_edges);
  const std::uint32_t* face = tree.face_of_slot.data() + b.first_face;
  for (std::uint32_t i = 0; i < n_edges; i += BoxGroup::width) {
    const auto edges = when.load(edge_boxes.groups[i / BoxGroup::width]);
    const unsigned near_edges = when.overlapping(edges, bounds_of(node_b)) & lanes_in(i, 0, n_edges);
    if (!near_edges) continue;
    const std::uint32_t slot = a.first_edge + i;
    const std::uint32_t *end0 = ends.of[0] + i, *end1 = ends.of[1] + i;
    for (unsigned lanes = near_faces; lanes; lanes &= lanes - 1) {
      const auto k = static_cast<std::uint32_t>(__builtin_ctz(lanes));
      unsigned m = when.overlapping(edges, bounds_at(&face_boxes.group, k)) & near_edges;
      if (!m) continue;
      for (const auto& corner : corners_b.of->face) {
        const std::uint32_t v = corners_b.numbers[corner[k]];
        m &= ~(equal16(end0, v) | equal16(end1, v));
      }
      append_pairs<false>(out.second, out.first, out.n, face[k], tree.edge_of_slot.data() + slot, m);
    }
  }
}

}  // namespace

void leaf_edge_faces(const Tree& tree, const LeafRange& a, const LeafRange& b, CandidateBuffer& edge_face) {
  const std::uint32_t* leaf_nodes = tree.leaf_nodes.data();
  const LeafRange* leaves = tree.leaves.data();
  const Node &node_a = tree.nodes.data()[leaf_nodes[&a - leaves]], &node_b = tree.nodes.data()[leaf_nodes[&b - leaves]];
  edges_against_faces(tree, a, b, node_a, node_b, edge_face);
  if (&a != &b) edges_against_faces(tree, b, a, node_b, node_a, edge_face);
}

}  // namespace hpccd::HPCCD_ISA
