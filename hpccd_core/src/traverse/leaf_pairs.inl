// SPDX-License-Identifier: Apache-2.0
// Included once per instruction set, after its header (base/simd/scalar.h). Corners are compared 16 at a time.

#include "traverse/leaf_pairs.h"

namespace hpccd::HPCCD_ISA {
namespace {

#include "elementary/kdop_lanes.inl"
#include "traverse/candidate_rows.inl"
#include "traverse/corners_against.inl"

// Orders the pairs from `begin` on: of two edges the one with the lower number comes first. Works on whole rows, into
// the space beyond the last pair, since loops of a few iterations cost more than their work.
HPCCD_HD void put_in_order(CandidateBuffer& out, std::uint32_t begin) {
  for (std::uint32_t row = begin; row < out.n; row += Tree::load_width)
    for (std::uint32_t i = row; i < row + Tree::load_width; ++i) {
      const std::uint32_t x = out.first[i], y = out.second[i];
      out.first[i] = x < y ? x : y, out.second[i] = x < y ? y : x;
    }
}

template <class Against>
HPCCD_HD void edge_pairs(const Against& corners, const LeafFeatures& a, const LeafFeatures& b, unsigned edges_a,
                         unsigned edges_b, CandidateBuffer& out) {
  const bool same = a.rows == b.rows;
  CandidateRows rows;
  for_each(edges_a, [&](std::uint32_t k) {
    rows.add(a.edges[k], corners.edges_near_edge(b, k) & (same ? edges_b & ~first_bits(k + 1) : edges_b));
  });
  const std::uint32_t begin = out.n;
  rows.append_to(out.first, out.second, out.n, b.edges, b.n_edges);
  put_in_order(out, begin);
}

template <class Against>
HPCCD_HD void vertex_face_pairs(const Against& corners, const LeafFeatures& a, const LeafFeatures& b,
                                unsigned vertices_a, unsigned faces_b, CandidateBuffer& out) {
  CandidateRows rows;
  for_each(vertices_a, [&](std::uint32_t i) { rows.add(a.corners[i], corners.faces_near_vertex(b, i) & faces_b); });
  rows.append_to(out.first, out.second, out.n, b.faces, b.n_faces);
}

template <class Kernel, class When>
HPCCD_HD void pairs_within(When when, const LeafFeatures& leaf, TestedFeatures tested, CandidateBuffer& edge_edge,
                           CandidateBuffer& vertex_face) {
  const unsigned all = first_bits(leaf.n_corners);
  const CornersAgainst<Kernel, Kernel, When> corners(when, leaf, leaf, typename Kernel::Lanes(when, leaf), all,
                                                     LeafPairOf::same);
  const unsigned edges = first_bits(leaf.n_edges), vertices = first_bits(leaf.n_vertices);
  if (tested.edge_edge) edge_pairs(corners, leaf, leaf, edges, edges, edge_edge);
  if (tested.vertex_face) vertex_face_pairs(corners, leaf, leaf, vertices, first_bits(leaf.n_faces), vertex_face);
}

// The features of a leaf that are near the other leaf's box.
struct NearFeatures {
  unsigned edges = 0, faces = 0, vertices = 0;
  template <class Outcodes>
  HPCCD_HD NearFeatures(const Outcodes& beyond, const LeafFeatures& leaf, TestedFeatures tested) {
    if (tested.edge_edge) edges = beyond.edges(leaf);
    if (tested.vertex_face) faces = beyond.faces(leaf), vertices = beyond.vertices(leaf);
  }
};

// Pairs these edges and vertices of a, one by one, with the edges and faces of b, and the vertices of b with the faces
// of a. Not inlined: copies in each caller increased compile time by half and made no scene faster.
template <class A, class B, class When>
[[gnu::noinline]] void near_pairs(When when, const LeafFeatures& a, const LeafFeatures& b,
                                  const typename A::Lanes& lanes_a, const typename B::Lanes& lanes_b,
                                  const NearFeatures& of_a, const NearFeatures& of_b, LeafPairOf leaves,
                                  CandidateBuffer& edge_edge, CandidateBuffer& vertex_face) {
  const unsigned edges = of_b.edges ? of_a.edges : 0, vertices_a = of_b.faces ? of_a.vertices : 0,
                 vertices_b = of_a.faces ? of_b.vertices : 0;
  if (edges || vertices_a) {
    const CornersAgainst<A, B, When> corners(when, a, b, lanes_b, corners_of(a, edges, 0) | vertices_a, leaves);
    if (edges) edge_pairs(corners, a, b, edges, of_b.edges, edge_edge);
    if (vertices_a) vertex_face_pairs(corners, a, b, vertices_a, of_b.faces, vertex_face);
  }
  if (vertices_b) {
    const CornersAgainst<B, A, When> corners(when, b, a, lanes_a, vertices_b, leaves);
    vertex_face_pairs(corners, b, a, vertices_b, of_a.faces, vertex_face);
  }
}

template <class A, class B, class When>
HPCCD_HD void pairs_between(When when, const LeafFeatures& a, const LeafFeatures& b, const Node& node_a,
                            const Node& node_b, TestedFeatures tested, CandidateBuffer& edge_edge,
                            CandidateBuffer& vertex_face) {
  const typename A::Lanes lanes_a(when, a);
  const typename B::Lanes lanes_b(when, b);
  const NearFeatures of_a(typename A::Outcodes(a, lanes_a, when.bounds(bounds_of(node_b))), a, tested);
  const NearFeatures of_b(typename B::Outcodes(b, lanes_b, when.bounds(bounds_of(node_a))), b, tested);
  const LeafPairOf leaves = node_a.mesh == node_b.mesh ? LeafPairOf::neighbours : LeafPairOf::strangers;
  // Of the smaller set one by one.
  if (__builtin_popcount(of_a.edges) <= __builtin_popcount(of_b.edges))
    near_pairs<A, B>(when, a, b, lanes_a, lanes_b, of_a, of_b, leaves, edge_edge, vertex_face);
  else
    near_pairs<B, A>(when, b, a, lanes_b, lanes_a, of_b, of_a, leaves, edge_edge, vertex_face);
}

// Boxes of sixteen leaves.
using BoxLanes = Rows16<n_bounds>;

// Which pairs of leaves of two blocks are near. box(bounds): the box that stands for that of the other leaf or block;
// apart: which boxes in lanes are apart from it along an axis. Throughout the motion (Node::overlaps):
struct LeavesInMotion {
  template <class Box>
  HPCCD_HD const Box& box(const Box& b) const {
    return b;
  }
  template <class Box>
  HPCCD_HD Mask16 apart(const BoxLanes& lanes, const Box& b, std::uint32_t axis) const {
    const Mask16 below =
        less(lanes[high(0, axis)], all16(b[low(0, axis)])) & less(lanes[high(1, axis)], all16(b[low(1, axis)]));
    const Mask16 above =
        less(all16(b[high(0, axis)]), lanes[low(0, axis)]) & less(all16(b[high(1, axis)]), lanes[low(1, axis)]);
    return below | above;
  }
  HPCCD_HD bool are_apart(const Kdop& a, const Kdop& b) const { return HPCCD_ISA::are_apart(lanes_of(a), lanes_of(b)); }
  HPCCD_HD static KdopLanes lanes_of(const Kdop& k) { return {load16(k.low), load16(k.high)}; }
};

// The same for two meshes with an excess.
struct LeavesLessExcess : LeavesInMotion {
  float excess;
  template <class Box>
  HPCCD_HD FeatureBox box(const Box& b) const {
    return moved(b, [&](std::uint32_t) { return -excess; });
  }
};

// Up to a time below 1 (Node::overlap_until).
struct LeavesUntil {
  float time;
  UntilTime kdops;
  template <class Box>
  HPCCD_HD const Box& box(const Box& b) const {
    return b;
  }
  template <class Box>
  HPCCD_HD Mask16 apart(const BoxLanes& lanes, const Box& b, std::uint32_t axis) const {
    return open(all16(b[low(0, axis)]) - lanes[high(0, axis)], all16(b[low(1, axis)]) - lanes[high(1, axis)]) |
           open(lanes[low(0, axis)] - all16(b[high(0, axis)]), lanes[low(1, axis)] - all16(b[high(1, axis)]));
  }
  // Whether a gap stays open, from its widths at both ends of the motion.
  HPCCD_HD Mask16 open(const Floats16& at_t0, const Floats16& at_t1) const {
    return less(all16(0), at_t0) & less(all16(between_ends), at_t0 + all16(time) * (at_t1 - at_t0));
  }
  HPCCD_HD bool are_apart(const Kdop& a, const Kdop& b) const {
    return kdops.are_apart(LeavesInMotion::lanes_of(a), LeavesInMotion::lanes_of(b));
  }
};

// The same by boxes at the start (Node::near_at_start).
struct LeavesAtStart : LeavesUntil {
  float reach;
  template <class Box>
  HPCCD_HD FeatureBox box(const Box& b) const {
    return moved(b, [&](std::uint32_t) { return reach; });
  }
  template <class Box>
  HPCCD_HD Mask16 apart(const BoxLanes& lanes, const Box& b, std::uint32_t axis) const {
    return less(lanes[high(0, axis)], all16(b[low(0, axis)])) | less(all16(b[high(0, axis)]), lanes[low(0, axis)]);
  }
};

// In one snapshot (Node::near_in_snapshot), where there are no k-DOPs.
struct LeavesInSnapshot {
  float reach;
  template <class Box>
  HPCCD_HD FeatureBox box(const Box& b) const {
    const float slanted = slanted_reach(reach);
    return moved(b, [&](std::uint32_t i) { return i < n_bounds / 2 ? reach : slanted; });
  }
  template <class Box>
  HPCCD_HD Mask16 apart(const BoxLanes& lanes, const Box& b, std::uint32_t axis) const {
    Mask16 apart;
    for (std::uint32_t end = 0; end < 2; ++end)
      apart = apart | less(lanes[high(end, axis)], all16(b[low(end, axis)])) |
              less(all16(b[high(end, axis)]), lanes[low(end, axis)]);
    return apart;
  }
  HPCCD_HD bool are_apart(const Kdop&, const Kdop&) const { return false; }
};

// Bit j: box j of sixteen is near this one.
template <class Which, class Box>
HPCCD_HD unsigned near_boxes(const Which& which, const BoxLanes& lanes, const Box& bounds) {
  const auto& b = which.box(bounds);
  Mask16 apart;
  for (std::uint32_t axis = 0; axis < 3; ++axis) apart = apart | which.apart(lanes, b, axis);
  return ~apart.bits() & 0xFFFF;
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

template <class Which>
HPCCD_HD std::uint32_t pairs_of_blocks(const Which& which, const Tree& tree, const Block& a, const Block& b,
                                       LeafPair* pairs) {
  const Node* nodes = tree.nodes.data();
  const Kdop* kdops = tree.by_kdops ? tree.kdops.data() : nullptr;
  const bool same = &a == &b;
  const BoxLanes boxes_b = load_rows(b.rows);
  unsigned near_a = first_bits(a.n_leaves), near_b = first_bits(b.n_leaves);
  if (!same) {
    near_a &= near_boxes(which, load_rows(a.rows), bounds_of(nodes[b.node]));
    near_b &= near_boxes(which, boxes_b, bounds_of(nodes[a.node]));
  }
  std::uint32_t n = 0;
  for (unsigned left = near_a; left; left &= left - 1) {
    const auto i = static_cast<std::uint32_t>(__builtin_ctz(left));
    const std::uint32_t number = a.first_leaf + i;
    unsigned m = near_boxes(which, boxes_b, Bounds<Block::width>{a.rows[0] + i}) & near_b;
    if (same) m &= ~0u << i;
    for (; m; m &= m - 1) {
      const std::uint32_t other = b.first_leaf + static_cast<std::uint32_t>(__builtin_ctz(m));
      pairs[n] = {number, other};  // kept only if counted
      n += !kdops || number == other || !which.are_apart(kdops[number], kdops[other]);
    }
  }
  return n;
}

}  // namespace

std::uint32_t block_pairs(const Tree& tree, const Block& a, const Block& b, LeafPair* pairs) {
  return pairs_of_blocks(LeavesInMotion(), tree, a, b, pairs);
}

std::uint32_t block_pairs_less_excess(const Tree& tree, const Block& a, const Block& b, float excess, LeafPair* pairs) {
  return pairs_of_blocks(LeavesLessExcess{{}, excess}, tree, a, b, pairs);
}

std::uint32_t block_pairs_until(const Tree& tree, const Block& a, const Block& b, float time, float reach,
                                const KdopMargin& margin, LeafPair* pairs) {
  const LeavesUntil which{time, until(margin, time)};
  return reach < 0 ? pairs_of_blocks(which, tree, a, b, pairs)
                   : pairs_of_blocks(LeavesAtStart{which, reach}, tree, a, b, pairs);
}

std::uint32_t block_pairs_in_snapshot(const Tree& tree, const Block& a, const Block& b, float reach, LeafPair* pairs) {
  return pairs_of_blocks(LeavesInSnapshot{reach}, tree, a, b, pairs);
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
