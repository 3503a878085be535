// SPDX-License-Identifier: Apache-2.0
// Included once per instruction set, after its header (base/simd/scalar.h). Corners are compared 16 at a time.

#include "traverse/leaf_pairs.h"

namespace hpccd::HPCCD_ISA {
namespace {

#include "traverse/candidate_rows.inl"
#include "traverse/sharing.inl"

// Orders the pairs from `begin` on: of two edges the one with the lower number comes first. Works on whole rows, into
// the space beyond the last pair, since loops of a few iterations cost more than their work.
HPCCD_HD void put_in_order(CandidateBuffer& out, std::uint32_t begin) {
  for (std::uint32_t row = begin; row < out.n; row += Tree::load_width)
    for (std::uint32_t i = row; i < row + Tree::load_width; ++i) {
      const std::uint32_t x = out.first[i], y = out.second[i];
      out.first[i] = x < y ? x : y, out.second[i] = x < y ? y : x;
    }
}

// Pairs these edges of a, one by one, with these edges of b. Not inlined, like the next function: copies of both in
// each caller increased compile time by half and made no scene faster.
template <class A, class B, class When>
[[gnu::noinline]] void edge_pairs(When when, const LeafFeatures& a, const LeafFeatures& b,
                                  const typename B::Lanes& lanes_b, const Sharing& shared, unsigned edges_a,
                                  unsigned edges_b, CandidateBuffer& out) {
  const bool same = a.rows == b.rows;
  const FeatureBoxes<A, 2> boxes(a);
  const auto& end = a.corners_of->edge;
  CandidateRows rows;
  for_each(edges_a, [&](std::uint32_t k) {
    unsigned m = edges_b & ~(shared.edges[end[0][k]] | shared.edges[end[1][k]]);
    if (same) m &= ~first_bits(k + 1);
    rows.add(a.edges[k], typename B::Outcodes(when, b, lanes_b, boxes[k]).edges(b) & m);
  });
  const std::uint32_t begin = out.n;
  rows.append_to(out.first, out.second, out.n, b.edges, b.n_edges);
  put_in_order(out, begin);
}

// Pairs these vertices of a, one by one, with these faces of b. `shared` may be null.
template <class A, class B, class When>
[[gnu::noinline]] void vertex_face_pairs(When when, const LeafFeatures& a, const LeafFeatures& b,
                                         const typename B::Lanes& lanes_b, const Sharing* shared, unsigned vertices_a,
                                         unsigned faces_b, CandidateBuffer& out) {
  CandidateRows rows;
  for_each(vertices_a, [&](std::uint32_t k) {
    const std::uint32_t vertex = a.corners[k];
    const unsigned others =
        faces_b & ~(shared ? shared->faces[k] : FeaturesAt(b, first_bits(b.n_corners), vertex).faces);
    rows.add(vertex, others & typename B::Outcodes(when, b, lanes_b, A::box_of(a, k)).faces(b));
  });
  rows.append_to(out.first, out.second, out.n, b.faces, b.n_faces);
}

template <class Kernel, class When>
HPCCD_HD void pairs_within(When when, const LeafFeatures& leaf, TestedFeatures tested, CandidateBuffer& edge_edge,
                           CandidateBuffer& vertex_face) {
  const typename Kernel::Lanes lanes(when, leaf);
  Sharing own;
  find_own(leaf, own);
  const unsigned edges = first_bits(leaf.n_edges), vertices = first_bits(leaf.n_vertices);
  if (tested.edge_edge) edge_pairs<Kernel, Kernel>(when, leaf, leaf, lanes, own, edges, edges, edge_edge);
  if (!tested.vertex_face) return;
  vertex_face_pairs<Kernel, Kernel>(when, leaf, leaf, lanes, &own, vertices, first_bits(leaf.n_faces), vertex_face);
}

// Loops only over features near the other leaf's box.
template <class A, class B, class When>
HPCCD_HD void pairs_between(When when, const LeafFeatures& a, const LeafFeatures& b, const Node& node_a,
                            const Node& node_b, TestedFeatures tested, CandidateBuffer& edge_edge,
                            CandidateBuffer& vertex_face) {
  const typename A::Lanes lanes_a(when, a);
  const typename B::Lanes lanes_b(when, b);
  const typename A::Outcodes near_a(when, a, lanes_a, bounds_of(node_b));
  const typename B::Outcodes near_b(when, b, lanes_b, bounds_of(node_a));
  const unsigned edges_a = tested.edge_edge ? near_a.edges(a) : 0, edges_b = near_b.edges(b);
  const bool edges = edges_a && edges_b, neighbours = node_a.mesh == node_b.mesh;
  Sharing a_with_b, b_with_a;
  if (edges) {
    if (neighbours) find_shared(a, near_a.corners(a), b, near_b.corners(b), a_with_b, b_with_a);
    // Loops over the smaller set.
    if (__builtin_popcount(edges_a) <= __builtin_popcount(edges_b))
      edge_pairs<A, B>(when, a, b, lanes_b, a_with_b, edges_a, edges_b, edge_edge);
    else
      edge_pairs<B, A>(when, b, a, lanes_a, b_with_a, edges_b, edges_a, edge_edge);
  }
  if (!tested.vertex_face) return;
  const bool known = edges || !neighbours;  // not worth computing for a few vertices
  const unsigned faces_a = near_a.faces(a), faces_b = near_b.faces(b);
  if (faces_b)
    vertex_face_pairs<A, B>(when, a, b, lanes_b, known ? &a_with_b : nullptr, near_a.vertices(a), faces_b, vertex_face);
  if (faces_a)
    vertex_face_pairs<B, A>(when, b, a, lanes_a, known ? &b_with_a : nullptr, near_b.vertices(b), faces_a, vertex_face);
}

// Boxes of sixteen leaves.
struct BoxLanes {
  Rows16<n_bounds> rows;
  HPCCD_HD explicit BoxLanes(const float (&at)[n_bounds][Block::width]) : rows(load_rows(at)) {}
  // Bit j: box j overlaps b (MotionBox::overlaps).
  template <class Box>
  HPCCD_HD unsigned overlapping(const Box& b) const {
    Mask16 apart;
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
      const Mask16 below = less(rows[high(0, axis)], all16(b[low(0, axis)]));
      const Mask16 above = less(all16(b[high(0, axis)]), rows[low(0, axis)]);
      apart = apart | (below & less(rows[high(1, axis)], all16(b[low(1, axis)])));
      apart = apart | (above & less(all16(b[high(1, axis)]), rows[low(1, axis)]));
    }
    return ~apart.bits() & 0xFFFF;
  }
};

// Separated along a direction of their k-DOPs.
HPCCD_HD bool are_apart(const Kdop& a, const Kdop& b) {
  return any_in_both_halves(less(load16(a.high), load16(b.low)), less(load16(b.high), load16(a.low)));
}

template <class When>
HPCCD_HD void pairs_of_leaves(When when, const Tree& tree, const LeafRange& a, const LeafRange& b,
                              TestedFeatures tested, CandidateBuffer& edge_edge, CandidateBuffer& vertex_face) {
  const std::uint32_t* leaf_nodes = tree.leaf_nodes.data();
  const LeafRange* leaves = tree.leaves.data();
  const Node &node_a = tree.nodes.data()[leaf_nodes[&a - leaves]], &node_b = tree.nodes.data()[leaf_nodes[&b - leaves]];
  const LeafFeatures leaf_a(tree, a), leaf_b(tree, b);
  with_kernels<When>(tree, leaf_a, leaf_b, [&](auto of_a, auto of_b) {
    using A = decltype(of_a);
    using B = decltype(of_b);
    if constexpr (std::is_same_v<A, B>)  // otherwise the leaves differ
      if (&a == &b) return pairs_within<A>(when, leaf_a, tested, edge_edge, vertex_face);
    pairs_between<A, B>(when, leaf_a, leaf_b, node_a, node_b, tested, edge_edge, vertex_face);
  });
}

// less(bounds): a box that replaces the leaf's own.
template <class Less>
HPCCD_HD std::uint32_t pairs_of_blocks(Less&& less, const Tree& tree, const Block& a, const Block& b, LeafPair* pairs) {
  const Node* nodes = tree.nodes.data();
  const Kdop* kdops = tree.by_kdops ? tree.kdops.data() : nullptr;
  const bool same = &a == &b;
  const BoxLanes boxes_b(b.rows);
  unsigned near_a = first_bits(a.n_leaves), near_b = first_bits(b.n_leaves);
  if (!same) {
    near_a &= BoxLanes(a.rows).overlapping(less(bounds_of(nodes[b.node])));
    near_b &= boxes_b.overlapping(less(bounds_of(nodes[a.node])));
  }
  std::uint32_t n = 0;
  for (unsigned left = near_a; left; left &= left - 1) {
    const auto i = static_cast<std::uint32_t>(__builtin_ctz(left));
    const std::uint32_t number = a.first_leaf + i;
    unsigned m = boxes_b.overlapping(less(Bounds<Block::width>{a.rows[0] + i})) & near_b;
    if (same) m &= ~0u << i;
    for (; m; m &= m - 1) {
      const std::uint32_t other = b.first_leaf + static_cast<std::uint32_t>(__builtin_ctz(m));
      pairs[n] = {number, other};  // kept only if counted
      n += !kdops || number == other || !are_apart(kdops[number], kdops[other]);
    }
  }
  return n;
}

}  // namespace

std::uint32_t block_pairs(const Tree& tree, const Block& a, const Block& b, LeafPair* pairs) {
  return pairs_of_blocks([](const auto& bounds) { return bounds; }, tree, a, b, pairs);
}

std::uint32_t block_pairs_less_excess(const Tree& tree, const Block& a, const Block& b, float excess, LeafPair* pairs) {
  const auto less = [&](const auto& bounds) {
    FeatureBox box;
    for (std::uint32_t i = 0; i < n_bounds; ++i)
      box.at[i] = side_of_bound(i) == Side::low ? bounds[i] + excess : bounds[i] - excess;
    return box;
  };
  return pairs_of_blocks(less, tree, a, b, pairs);
}

void leaf_pairs(const Tree& tree, const LeafRange& a, const LeafRange& b, TestedFeatures tested,
                CandidateBuffer& edge_edge, CandidateBuffer& vertex_face) {
  pairs_of_leaves(BothEnds(), tree, a, b, tested, edge_edge, vertex_face);
}

void leaf_pairs_less_excess(const Tree& tree, const LeafRange& a, const LeafRange& b, TestedFeatures tested,
                            float excess, CandidateBuffer& edge_edge, CandidateBuffer& vertex_face) {
  pairs_of_leaves(LessExcess{{}, excess}, tree, a, b, tested, edge_edge, vertex_face);
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
