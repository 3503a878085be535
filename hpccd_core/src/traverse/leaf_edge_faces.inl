// SPDX-License-Identifier: Apache-2.0
// Included once per instruction set, after its header (base/simd/scalar.h), under the rules of leaf_pairs.inl.

#include "traverse/leaf_edge_faces.h"

namespace hpccd::HPCCD_ISA {
namespace {

#include "traverse/candidate_rows.inl"
#include "traverse/face_planes.inl"

// Pairs these faces of a, one by one, with these edges of b. Planes come before boxes: they reject more and take
// less time.
template <class A, class B>
[[gnu::noinline]] void face_edge_pairs(const LeafFeatures& a, const LeafFeatures& b, const typename B::Lanes& lanes_b,
                                       const PlaneErrors& errors, LeafPairOf leaves, unsigned faces_a, unsigned edges_b,
                                       CandidateBuffer& out) {
  if (!faces_a || !edges_b) return;
  CornersAgainst<A, B, TouchingInSnapshot> corners(a, b, corners_of(a, 0, faces_a), leaves);
  unsigned edges_of[CornersOf::most_faces], left = 0;
  for_each(faces_a, [&](std::uint32_t k) {
    unsigned m = edges_b & ~corners.edges_sharing_face(k);
    if (errors.known) m &= PlaneSides<B>(FacePlane::of<A>(a, k, errors), b).edges(b);
    edges_of[k] = m, left |= (m != 0 ? 1u : 0u) << k;
  });
  if (!left) return;
  corners.compare({}, a, b, lanes_b, corners_of(a, 0, left));
  CandidateRows rows;
  for_each(left, [&](std::uint32_t k) { rows.add(a.faces[k], edges_of[k] & corners.edges_near_face(b, k)); });
  rows.append_to(out.second, out.first, out.n, b.edges, b.n_edges);
}

}  // namespace

void leaf_edge_faces(const Tree& tree, const LeafRange& a, const LeafRange& b, CandidateBuffer& edge_face) {
  const std::uint32_t* leaf_nodes = tree.leaf_nodes.data();
  const LeafRange* leaves = tree.leaves.data();
  const Node &node_a = tree.nodes.data()[leaf_nodes[&a - leaves]], &node_b = tree.nodes.data()[leaf_nodes[&b - leaves]];
  const LeafFeatures leaf_a(tree, a), leaf_b(tree, b);
  const PlaneErrors errors(tree, node_a, node_b);
  with_kernels<TouchingInSnapshot>(tree, leaf_a, leaf_b, [&](auto of_a, auto of_b) {
    using A = decltype(of_a);
    using B = decltype(of_b);
    const typename A::Lanes lanes_a({}, leaf_a);
    if constexpr (std::is_same_v<A, B>)  // otherwise the leaves differ
      if (&a == &b)
        return face_edge_pairs<A, A>(leaf_a, leaf_a, lanes_a, errors, LeafPairOf::same, first_bits(leaf_a.n_faces),
                                     first_bits(leaf_a.n_edges), edge_face);
    const typename B::Lanes lanes_b({}, leaf_b);
    const typename A::Outcodes near_a({}, leaf_a, lanes_a, bounds_of(node_b));
    const typename B::Outcodes near_b({}, leaf_b, lanes_b, bounds_of(node_a));
    const LeafPairOf leaves = node_a.mesh == node_b.mesh ? LeafPairOf::neighbours : LeafPairOf::strangers;
    face_edge_pairs<A, B>(leaf_a, leaf_b, lanes_b, errors, leaves, near_a.faces(leaf_a), near_b.edges(leaf_b),
                          edge_face);
    face_edge_pairs<B, A>(leaf_b, leaf_a, lanes_a, errors, leaves, near_b.faces(leaf_b), near_a.edges(leaf_a),
                          edge_face);
  });
}

}  // namespace hpccd::HPCCD_ISA
