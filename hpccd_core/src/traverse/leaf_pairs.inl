// SPDX-License-Identifier: Apache-2.0
// Included once per instruction set, after its header (base/simd/scalar.h). Boxes are compared 16 at a time.

#include "traverse/leaf_pairs.h"

namespace hpccd::HPCCD_ISA {
namespace {

#include "traverse/leaf_boxes.inl"

// Edges of a that are near b, against all edges of b.
template <class When>
HPCCD_HD void near_edges(When when, const Tree& tree, const Near& near_a, const LeafRange& a, const LeafCorners& corners_a,
                         const EdgeBoxes& boxes_a, const LeafRange& b, const LeafCorners& corners_b,
                         const EdgeBoxes& boxes_b, CandidateBuffer& out) {
  const bool same = &a == &b;
  const std::uint32_t n_a = a.n_edges(), n_b = b.n_edges();
  const EdgeEnds ends(corners_b, corners_b.of->edge, n_b);
  const std::uint32_t* edge = tree.edge_of_slot.data();
  for (std::uint32_t i = 0; i < n_b; i += BoxGroup::width) {
    const auto group = when.load(boxes_b.groups[i / BoxGroup::width]);
    const std::uint32_t slot = b.first_edge + i;
    const std::uint32_t *end0 = ends.of[0] + i, *end1 = ends.of[1] + i;
    for_each(near_a, n_a, [&](std::uint32_t k) {
      unsigned m =
          when.overlapping(group, when.bounds(bounds_at(boxes_a.groups, k))) & lanes_in(i, same ? k + 1 : 0, n_b);
      if (!m) return;
      const std::uint32_t v0 = corners_a.numbers[corners_a.of->edge[0][k]],
                          v1 = corners_a.numbers[corners_a.of->edge[1][k]];
      m &= ~(equal16(end0, v0) | equal16(end0, v1) | equal16(end1, v0) | equal16(end1, v1));
      append<true>(out, edge[a.first_edge + k], edge + slot, m);
    });
  }
}

template <class When>
HPCCD_HD void edge_pairs(When when, const Tree& tree, const LeafRange& a, const LeafRange& b, const LeafCorners& corners_a,
                         const LeafCorners& corners_b, const Node& node_a, const Node& node_b, CandidateBuffer& out) {
  const EdgeBoxes boxes_a(corners_a, a.n_edges());
  const Near near_a = near(when, boxes_a.groups, 0, a.n_edges(), node_b);
  if (!near_a.count) return;
  if (&a == &b) return near_edges(when, tree, near_a, a, corners_a, boxes_a, a, corners_a, boxes_a, out);
  const EdgeBoxes boxes_b(corners_b, b.n_edges());
  const Near near_b = near(when, boxes_b.groups, 0, b.n_edges(), node_a);
  if (!near_b.count) return;
  // One by one the fewer, in groups the others.
  if (near_a.count <= near_b.count)
    near_edges(when, tree, near_a, a, corners_a, boxes_a, b, corners_b, boxes_b, out);
  else
    near_edges(when, tree, near_b, b, corners_b, boxes_b, a, corners_a, boxes_a, out);
}

// Vertices of a against faces of b.
template <class When>
HPCCD_HD void vertex_face_pairs(When when, const Tree& tree, const LeafRange& a, const LeafRange& b,
                                const LeafCorners& corners_a, const LeafCorners& corners_b, const Node& node_b,
                                CandidateBuffer& out) {
  const std::uint32_t n_a = a.n_vertices();
  const VertexBoxes boxes(corners_a, n_a);
  static_assert(Tree::leaf_size <= BoxGroup::width);
  const Near near_a = near(when, boxes.groups, 0, n_a, node_b);
  if (!near_a.count) return;
  const FaceBoxes face_boxes(corners_b);
  const FaceCorners corners(corners_b, corners_b.of->face, b.n_faces());
  const std::uint32_t* face = tree.face_of_slot.data() + b.first_face;
  const auto faces = when.load(face_boxes.group);
  for_each(near_a, n_a, [&](std::uint32_t k) {
    unsigned m = when.overlapping(faces, when.bounds(bounds_at(boxes.groups, k))) & lanes_in(0, 0, b.n_faces());
    if (!m) return;
    const std::uint32_t v = corners_a.numbers[k];
    m &= ~(equal16(corners.of[0], v) | equal16(corners.of[1], v) | equal16(corners.of[2], v));
    append<false>(out, v, face, m);
  });
}

// Along a direction of their k-DOPs.
HPCCD_HD bool are_apart(const Kdop& a, const Kdop& b) {
  return any_in_both_halves(less(load16(a.high), load16(b.low)), less(load16(b.high), load16(a.low)));
}

template <class When>
HPCCD_HD void pairs_of_leaves(When when, const Tree& tree, const LeafRange& a, const LeafRange& b,
                              CandidateBuffer& edge_edge, CandidateBuffer& vertex_face) {
  const std::uint32_t* leaf_nodes = tree.leaf_nodes.data();
  const LeafRange* leaves = tree.leaves.data();
  const Node &node_a = tree.nodes.data()[leaf_nodes[&a - leaves]], &node_b = tree.nodes.data()[leaf_nodes[&b - leaves]];
  const LeafCorners corners_a(tree, a), corners_b(tree, b);
  edge_pairs(when, tree, a, b, corners_a, corners_b, node_a, node_b, edge_edge);
  vertex_face_pairs(when, tree, a, b, corners_a, corners_b, node_b, vertex_face);
  if (&a != &b) vertex_face_pairs(when, tree, b, a, corners_b, corners_a, node_a, vertex_face);
}

}  // namespace

std::uint32_t block_pairs(const Tree& tree, const Block& a, const Block& b, LeafPair* pairs) {
  constexpr BothEnds when;
  const Node* nodes = tree.nodes.data();
  const Kdop* kdops = tree.kdops.data();
  const bool same = &a == &b;
  const auto group = load_rows(b.rows);
  unsigned near_a = lanes_in(0, 0, a.n_leaves), near_b = lanes_in(0, 0, b.n_leaves);
  if (!same) {
    near_a &= when.overlapping(load_rows(a.rows), bounds_of(nodes[b.node]));
    near_b &= when.overlapping(group, bounds_of(nodes[a.node]));
  }
  std::uint32_t n = 0;
  for (unsigned left = near_a; left; left &= left - 1) {
    const auto i = static_cast<std::uint32_t>(__builtin_ctz(left));
    const std::uint32_t number = a.first_leaf + i;
    unsigned m = when.overlapping(group, Bounds<Block::width>{a.rows[0] + i}) & near_b;
    if (same) m &= ~0u << i;
    for (; m; m &= m - 1) {
      const std::uint32_t other = b.first_leaf + static_cast<std::uint32_t>(__builtin_ctz(m));
      pairs[n] = {number, other};  // kept only if counted
      n += !kdops || number == other || !are_apart(kdops[number], kdops[other]);
    }
  }
  return n;
}

void leaf_pairs(const Tree& tree, const LeafRange& a, const LeafRange& b, CandidateBuffer& edge_edge,
                CandidateBuffer& vertex_face) {
  pairs_of_leaves(BothEnds(), tree, a, b, edge_edge, vertex_face);
}

void leaf_pairs_until(const Tree& tree, const LeafRange& a, const LeafRange& b, float until, CandidateBuffer& edge_edge,
                      CandidateBuffer& vertex_face) {
  pairs_of_leaves(Until{until}, tree, a, b, edge_edge, vertex_face);
}

void leaf_pairs_at_start(const Tree& tree, const LeafRange& a, const LeafRange& b, float reach,
                         CandidateBuffer& edge_edge, CandidateBuffer& vertex_face) {
  pairs_of_leaves(AtStart{reach}, tree, a, b, edge_edge, vertex_face);
}

void leaf_pairs_in_snapshot(const Tree& tree, const LeafRange& a, const LeafRange& b, float reach,
                            CandidateBuffer& edge_edge, CandidateBuffer& vertex_face) {
  pairs_of_leaves(InSnapshot{reach}, tree, a, b, edge_edge, vertex_face);
}

}  // namespace hpccd::HPCCD_ISA
