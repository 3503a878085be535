// SPDX-License-Identifier: Apache-2.0
// Included once per instruction set, after its header (base/simd/scalar.h), under the rules of leaf_pairs.inl.

#include "traverse/leaf_edge_faces.h"

namespace hpccd::HPCCD_ISA {
namespace {

#include "traverse/candidate_rows.inl"
#include "traverse/corners_against.inl"

// Faces and edges of a leaf.
struct NearFeatures {
  unsigned faces, edges;
  HPCCD_HD int number() const { return __builtin_popcount(faces) + __builtin_popcount(edges); }
};

// Pairs these features of a, one by one, with these of b.
template <class A, class B>
[[gnu::noinline]] void near_edge_faces(const LeafFeatures& a, const LeafFeatures& b, const typename B::Lanes& lanes_b,
                                       LeafPairOf leaves, const NearFeatures& of_a, const NearFeatures& of_b,
                                       CandidateBuffer& out) {
  const unsigned faces = of_b.edges ? of_a.faces : 0, edges = of_b.faces ? of_a.edges : 0;
  const CornersAgainst<A, B, TouchingInSnapshot> corners({}, a, b, lanes_b, corners_of(a, edges, faces), leaves);
  CandidateRows of_faces, of_edges;
  for_each(faces, [&](std::uint32_t k) { of_faces.add(a.faces[k], corners.edges_near_face(b, k) & of_b.edges); });
  for_each(edges, [&](std::uint32_t k) { of_edges.add(a.edges[k], corners.faces_near_edge(b, k) & of_b.faces); });
  of_faces.append_to(out.second, out.first, out.n, b.edges, b.n_edges);
  of_edges.append_to(out.first, out.second, out.n, b.faces, b.n_faces);
}

}  // namespace

void leaf_edge_faces(const Tree& tree, const LeafRange& a, const LeafRange& b, CandidateBuffer& edge_face) {
  const std::uint32_t* leaf_nodes = tree.leaf_nodes.data();
  const LeafRange* leaves = tree.leaves.data();
  const Node &node_a = tree.nodes.data()[leaf_nodes[&a - leaves]], &node_b = tree.nodes.data()[leaf_nodes[&b - leaves]];
  const LeafFeatures leaf_a(tree, a), leaf_b(tree, b);
  with_kernels<TouchingInSnapshot>(tree, leaf_a, leaf_b, [&](auto of_a, auto of_b) {
    using A = decltype(of_a);
    using B = decltype(of_b);
    const typename A::Lanes lanes_a({}, leaf_a);
    if constexpr (std::is_same_v<A, B>)  // otherwise the leaves differ
      if (&a == &b)
        return near_edge_faces<A, A>(leaf_a, leaf_a, lanes_a, LeafPairOf::same, {first_bits(leaf_a.n_faces), 0},
                                     {0, first_bits(leaf_a.n_edges)}, edge_face);
    const typename B::Lanes lanes_b({}, leaf_b);
    const typename A::Outcodes near_a(leaf_a, lanes_a, bounds_of(node_b));
    const typename B::Outcodes near_b(leaf_b, lanes_b, bounds_of(node_a));
    const LeafPairOf leaves_of = node_a.mesh == node_b.mesh ? LeafPairOf::neighbours : LeafPairOf::strangers;
    const NearFeatures features_a{near_a.faces(leaf_a), near_a.edges(leaf_a)},
        features_b{near_b.faces(leaf_b), near_b.edges(leaf_b)};
    // Of the smaller set one by one.
    if (features_a.number() <= features_b.number())
      near_edge_faces<A, B>(leaf_a, leaf_b, lanes_b, leaves_of, features_a, features_b, edge_face);
    else
      near_edge_faces<B, A>(leaf_b, leaf_a, lanes_a, leaves_of, features_b, features_a, edge_face);
  });
}

}  // namespace hpccd::HPCCD_ISA
