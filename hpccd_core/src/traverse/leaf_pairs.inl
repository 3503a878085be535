// SPDX-License-Identifier: Apache-2.0
// Included once per instruction set, after its header (base/simd/scalar.h). Boxes are compared 16 at a time.

#include "traverse/leaf_pairs.h"

namespace hpccd::HPCCD_ISA {
namespace {

HPCCD_HD constexpr std::uint32_t low(std::uint32_t end, std::uint32_t axis) {
  return bound_number(end, Side::low, axis);
}
HPCCD_HD constexpr std::uint32_t high(std::uint32_t end, std::uint32_t axis) {
  return bound_number(end, Side::high, axis);
}

// A box to compare with: its bounds, in the order of a group's rows, each `stride` numbers behind the one before.
template <std::uint32_t stride>
struct Bounds {
  const float* at;
  HPCCD_HD float operator[](std::uint32_t row) const { return at[row * stride]; }
};

// Plain pointers: methods of std::vector compiled here could be linked into code for older processors.
HPCCD_HD Bounds<BoxGroup::width> bounds_at(const BoxGroup* groups, std::uint32_t i) {
  return {groups[i / BoxGroup::width].rows[0] + i % BoxGroup::width};
}
HPCCD_HD Bounds<1> bounds_of(const Node& node) { return {node.box.t0.low}; }

using Group = Rows16<n_bounds>;

// Bit j: box j of the group overlaps b (MotionBox::overlaps).
template <class Bounds>
HPCCD_HD unsigned overlapping(const Group& g, Bounds b) {
  Mask16 apart;
  for (std::uint32_t axis = 0; axis < 3; ++axis) {
    const Mask16 below = less(g[high(0, axis)], all16(b[low(0, axis)]));
    const Mask16 above = less(all16(b[high(0, axis)]), g[low(0, axis)]);
    apart = apart | (below & less(g[high(1, axis)], all16(b[low(1, axis)])));
    apart = apart | (above & less(all16(b[high(1, axis)]), g[low(1, axis)]));
  }
  return ~apart.bits() & 0xFFFF;
}

// The lanes of the group [i, i + 16) that lie in [begin, end).
HPCCD_HD unsigned lanes_in(std::uint32_t i, std::uint32_t begin, std::uint32_t end) {
  unsigned m = end - i >= 16 ? 0xFFFFu : (1u << (end - i)) - 1;
  if (begin > i) m &= begin - i >= 16 ? 0u : ~((1u << (begin - i)) - 1);
  return m;
}

// Appends the pairs of `number` with those of the 16 features from `others` on that are in m.
template <bool ascending>
HPCCD_HD void append(CandidateBuffer& out, std::uint32_t number, const std::uint32_t* others, unsigned m) {
  append_pairs<ascending>(out.first, out.second, out.n, number, others, m);
}

// Features of one leaf that overlap the other leaf's box: a bit each, by group.
struct Near {
  static constexpr std::uint32_t most_groups = (4 * Tree::leaf_size + BoxGroup::width - 1) / BoxGroup::width;
  unsigned lanes[most_groups] = {};
  unsigned count = 0;
};

// Of features begin to end - 1 of the groups.
HPCCD_HD Near near(const BoxGroup* groups, std::uint32_t begin, std::uint32_t end, const Node& other) {
  Near n;
  for (std::uint32_t i = 0, group = 0; i < end; i += BoxGroup::width, ++group)
    n.lanes[group] = overlapping(load_rows(groups[group].rows), bounds_of(other)) & lanes_in(i, begin, end),
    n.count += static_cast<unsigned>(__builtin_popcount(n.lanes[group]));
  return n;
}

// f(number) for each of them.
template <class Function>
HPCCD_HD void for_each(const Near& n, std::uint32_t end, Function&& f) {
  for (std::uint32_t i = 0, group = 0; i < end; i += BoxGroup::width, ++group)
    for (unsigned lanes = n.lanes[group]; lanes; lanes &= lanes - 1) f(i + static_cast<unsigned>(__builtin_ctz(lanes)));
}

// Edges of a that are near b, against all edges of b.
HPCCD_HD void near_edges(const Tree& tree, const Near& near_a, const LeafRange& a, const LeafRange& b,
                         CandidateBuffer& out) {
  const bool same = &a == &b;
  const BoxGroup* all = tree.box_groups.get();
  const BoxGroup *groups_a = all + a.first_group, *groups_b = all + b.first_group;
  const std::uint32_t n_a = a.n_edges(), n_b = b.n_edges();
  const std::uint32_t *end0 = tree.edge_ends[0].data(), *end1 = tree.edge_ends[1].data();
  const std::uint32_t* edge = tree.edge_of_slot.data();
  for (std::uint32_t i = 0; i < n_b; i += BoxGroup::width) {
    const Group group = load_rows(groups_b[i / BoxGroup::width].rows);
    const std::uint32_t slot = b.first_edge + i;
    for_each(near_a, n_a, [&](std::uint32_t k) {
      unsigned m = overlapping(group, bounds_at(groups_a, k)) & lanes_in(i, same ? k + 1 : 0, n_b);
      if (!m) return;
      const std::uint32_t v0 = end0[a.first_edge + k], v1 = end1[a.first_edge + k];
      m &= ~(equal16(end0 + slot, v0) | equal16(end0 + slot, v1) | equal16(end1 + slot, v0) | equal16(end1 + slot, v1));
      append<true>(out, edge[a.first_edge + k], edge + slot, m);
    });
  }
}

HPCCD_HD void edge_pairs(const Tree& tree, const LeafRange& a, const LeafRange& b, const Node& node_a,
                         const Node& node_b, CandidateBuffer& out) {
  const BoxGroup* all = tree.box_groups.get();
  const BoxGroup *groups_a = all + a.first_group, *groups_b = all + b.first_group;
  const Near near_a = near(groups_a, 0, a.n_edges(), node_b);
  if (!near_a.count) return;
  if (&a == &b) return near_edges(tree, near_a, a, a, out);
  const Near near_b = near(groups_b, 0, b.n_edges(), node_a);
  if (!near_b.count) return;
  // One by one the fewer, in groups the others.
  const bool by_a = near_a.count <= near_b.count;
  near_edges(tree, by_a ? near_a : near_b, by_a ? a : b, by_a ? b : a, out);
}

// Vertices of a against faces of b.
HPCCD_HD void vertex_face_pairs(const Tree& tree, const LeafRange& a, const LeafRange& b, const Node& node_b,
                                CandidateBuffer& out) {
  const BoxGroup* all = tree.box_groups.get();
  const BoxGroup *groups_a = all + a.surface_group(), &group_b = all[b.surface_group()];
  const std::uint32_t first_a = a.first_vertex_lane(), end_a = first_a + a.n_vertices();
  static_assert(Tree::leaf_size <= BoxGroup::width);
  const Near near_a = near(groups_a, first_a, end_a, node_b);
  if (!near_a.count) return;
  const std::uint32_t* vertex = tree.vertex_of_slot.data() + a.first_vertex;
  const std::uint32_t* face = tree.face_of_slot.data() + b.first_face;
  const std::uint32_t *c0 = tree.face_corners[0].data() + b.first_face,
                      *c1 = tree.face_corners[1].data() + b.first_face,
                      *c2 = tree.face_corners[2].data() + b.first_face;
  const Group faces = load_rows(group_b.rows);
  for_each(near_a, end_a, [&](std::uint32_t k) {
    unsigned m = overlapping(faces, bounds_at(groups_a, k)) & lanes_in(0, 0, b.n_faces());
    if (!m) return;
    const std::uint32_t v = vertex[k - first_a];
    m &= ~(equal16(c0, v) | equal16(c1, v) | equal16(c2, v));
    append<false>(out, v, face, m);
  });
}

}  // namespace

void leaf_pairs(const Tree& tree, const LeafRange& a, const LeafRange& b, CandidateBuffer& edge_edge,
                CandidateBuffer& vertex_face) {
  const std::uint32_t* leaf_nodes = tree.leaf_nodes.data();
  const LeafRange* leaves = tree.leaves.data();
  const Node &node_a = tree.nodes.data()[leaf_nodes[&a - leaves]], &node_b = tree.nodes.data()[leaf_nodes[&b - leaves]];
  edge_pairs(tree, a, b, node_a, node_b, edge_edge);
  vertex_face_pairs(tree, a, b, node_b, vertex_face);
  if (&a != &b) vertex_face_pairs(tree, b, a, node_a, vertex_face);
}

}  // namespace hpccd::HPCCD_ISA
