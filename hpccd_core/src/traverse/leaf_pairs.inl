// SPDX-License-Identifier: Apache-2.0
// Included once per instruction set, after its header (base/simd/scalar.h). Boxes are compared 16 at a time.

#include "traverse/leaf_pairs.h"

namespace hpccd::HPCCD_ISA {
namespace {

#include "traverse/leaf_boxes.inl"

// Edges of a that are near b, against all edges of b.
template <class When>
HPCCD_HD void near_edges(When when, const Tree& tree, const Near& near_a, const LeafRange& a, const LeafRange& b,
                         CandidateBuffer& out) {
  const bool same = &a == &b;
  const BoxGroup* all = tree.box_groups.get();
  const BoxGroup *groups_a = all + a.first_group, *groups_b = all + b.first_group;
  const std::uint32_t n_a = a.n_edges(), n_b = b.n_edges();
  const std::uint32_t *end0 = tree.edge_ends[0].data(), *end1 = tree.edge_ends[1].data();
  const std::uint32_t* edge = tree.edge_of_slot.data();
  for (std::uint32_t i = 0; i < n_b; i += BoxGroup::width) {
    const auto group = when.load(groups_b[i / BoxGroup::width]);
    const std::uint32_t slot = b.first_edge + i;
    for_each(near_a, n_a, [&](std::uint32_t k) {
      unsigned m = when.overlapping(group, when.bounds(bounds_at(groups_a, k))) & lanes_in(i, same ? k + 1 : 0, n_b);
      if (!m) return;
      const std::uint32_t v0 = end0[a.first_edge + k], v1 = end1[a.first_edge + k];
      m &= ~(equal16(end0 + slot, v0) | equal16(end0 + slot, v1) | equal16(end1 + slot, v0) | equal16(end1 + slot, v1));
      append<true>(out, edge[a.first_edge + k], edge + slot, m);
    });
  }
}

template <class When>
HPCCD_HD void edge_pairs(When when, const Tree& tree, const LeafRange& a, const LeafRange& b, const Node& node_a,
                         const Node& node_b, CandidateBuffer& out) {
  const BoxGroup* all = tree.box_groups.get();
  const BoxGroup *groups_a = all + a.first_group, *groups_b = all + b.first_group;
  const Near near_a = near(when, groups_a, 0, a.n_edges(), node_b);
  if (!near_a.count) return;
  if (&a == &b) return near_edges(when, tree, near_a, a, a, out);
  const Near near_b = near(when, groups_b, 0, b.n_edges(), node_a);
  if (!near_b.count) return;
  // One by one the fewer, in groups the others.
  const bool by_a = near_a.count <= near_b.count;
  near_edges(when, tree, by_a ? near_a : near_b, by_a ? a : b, by_a ? b : a, out);
}

// Vertices of a against faces of b.
template <class When>
HPCCD_HD void vertex_face_pairs(When when, const Tree& tree, const LeafRange& a, const LeafRange& b, const Node& node_b,
                                CandidateBuffer& out) {
  const BoxGroup* all = tree.box_groups.get();
  const BoxGroup *groups_a = all + a.surface_group(), &group_b = all[b.surface_group()];
  const std::uint32_t first_a = a.first_vertex_lane(), end_a = first_a + a.n_vertices();
  static_assert(Tree::leaf_size <= BoxGroup::width);
  const Near near_a = near(when, groups_a, first_a, end_a, node_b);
  if (!near_a.count) return;
  const std::uint32_t* vertex = tree.vertex_of_slot.data() + a.first_vertex;
  const std::uint32_t* face = tree.face_of_slot.data() + b.first_face;
  const std::uint32_t *c0 = tree.face_corners[0].data() + b.first_face,
                      *c1 = tree.face_corners[1].data() + b.first_face,
                      *c2 = tree.face_corners[2].data() + b.first_face;
  const auto faces = when.load(group_b);
  for_each(near_a, end_a, [&](std::uint32_t k) {
    unsigned m = when.overlapping(faces, when.bounds(bounds_at(groups_a, k))) & lanes_in(0, 0, b.n_faces());
    if (!m) return;
    const std::uint32_t v = vertex[k - first_a];
    m &= ~(equal16(c0, v) | equal16(c1, v) | equal16(c2, v));
    append<false>(out, v, face, m);
  });
}

template <class When>
HPCCD_HD void pairs_of_leaves(When when, const Tree& tree, const LeafRange& a, const LeafRange& b,
                              TestedFeatures tested, CandidateBuffer& edge_edge, CandidateBuffer& vertex_face) {
  const std::uint32_t* leaf_nodes = tree.leaf_nodes.data();
  const LeafRange* leaves = tree.leaves.data();
  const Node &node_a = tree.nodes.data()[leaf_nodes[&a - leaves]], &node_b = tree.nodes.data()[leaf_nodes[&b - leaves]];
  if (tested.edge_edge) edge_pairs(when, tree, a, b, node_a, node_b, edge_edge);
  if (!tested.vertex_face) return;
  vertex_face_pairs(when, tree, a, b, node_b, vertex_face);
  if (&a != &b) vertex_face_pairs(when, tree, b, a, node_a, vertex_face);
}

}  // namespace

void leaf_pairs(const Tree& tree, const LeafRange& a, const LeafRange& b, TestedFeatures tested,
                CandidateBuffer& edge_edge, CandidateBuffer& vertex_face) {
  pairs_of_leaves(BothEnds(), tree, a, b, tested, edge_edge, vertex_face);
}

void leaf_pairs_until(const Tree& tree, const LeafRange& a, const LeafRange& b, TestedFeatures tested, float until,
                      CandidateBuffer& edge_edge, CandidateBuffer& vertex_face) {
  pairs_of_leaves(Until{until}, tree, a, b, tested, edge_edge, vertex_face);
}

void leaf_pairs_at_start(const Tree& tree, const LeafRange& a, const LeafRange& b, TestedFeatures tested, float reach,
                         CandidateBuffer& edge_edge, CandidateBuffer& vertex_face) {
  pairs_of_leaves(AtStart{reach}, tree, a, b, tested, edge_edge, vertex_face);
}

void leaf_pairs_in_snapshot(const Tree& tree, const LeafRange& a, const LeafRange& b, TestedFeatures tested,
                            float reach, CandidateBuffer& edge_edge, CandidateBuffer& vertex_face) {
  pairs_of_leaves(InSnapshot{reach}, tree, a, b, tested, edge_edge, vertex_face);
}

}  // namespace hpccd::HPCCD_ISA
