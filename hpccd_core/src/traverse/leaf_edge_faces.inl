// SPDX-License-Identifier: Apache-2.0
// Included once per instruction set, after its header (base/simd/scalar.h), under the rules of leaf_pairs.inl.

#include "traverse/leaf_edge_faces.h"

namespace hpccd::HPCCD_ISA {
namespace {

#include "traverse/candidate_rows.inl"
#include "traverse/face_planes.inl"

// Pairs these edges of a with these faces of b. The loop is over the faces, of which a leaf has fewer. Their planes
// come before their boxes: they reject more and take less time.
template <class A, class B>
[[gnu::noinline]] void edges_against_faces(const LeafFeatures& a, const LeafFeatures& b,
                                           const typename A::Lanes& lanes_a, const Sharing& shared, PlaneErrors errors,
                                           unsigned edges_a, unsigned faces_b, CandidateBuffer& out) {
  if (!edges_a || !faces_b) return;
  const FeatureBoxes<B, 3> boxes(b);
  CandidateRows rows;
  for_each(faces_b, [&](std::uint32_t k) {
    const auto& corner = b.corners_of->face;
    unsigned m = edges_a & ~(shared.edges[corner[0][k]] | shared.edges[corner[1][k]] | shared.edges[corner[2][k]]);
    if (errors.known) m &= PlaneSides<A>(FacePlane::of<B>(b, k, errors), a).edges(a);
    if (m) m &= typename A::Outcodes({}, a, lanes_a, boxes[k]).edges(a);
    rows.add(b.faces[k], m);
  });
  rows.append_to(out.second, out.first, out.n, a.edges, a.n_edges);
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
    const typename A::Outcodes near_a({}, leaf_a, lanes_a, bounds_of(node_b));
    const unsigned edges_a = near_a.edges(leaf_a), faces_a = near_a.faces(leaf_a);
    Sharing a_with_b, b_with_a;
    if constexpr (std::is_same_v<A, B>)  // otherwise the leaves differ
      if (&a == &b) {
        find_own(leaf_a, a_with_b);
        return edges_against_faces<A, A>(leaf_a, leaf_a, lanes_a, a_with_b, errors, edges_a, faces_a, edge_face);
      }
    const typename B::Lanes lanes_b({}, leaf_b);
    const typename B::Outcodes near_b({}, leaf_b, lanes_b, bounds_of(node_a));
    const unsigned edges_b = near_b.edges(leaf_b), faces_b = near_b.faces(leaf_b);
    if (!(edges_a && faces_b) && !(edges_b && faces_a)) return;
    if (node_a.mesh == node_b.mesh)
      find_shared(leaf_a, near_a.corners(leaf_a), leaf_b, near_b.corners(leaf_b), a_with_b, b_with_a);
    edges_against_faces<A, B>(leaf_a, leaf_b, lanes_a, b_with_a, errors, edges_a, faces_b, edge_face);
    edges_against_faces<B, A>(leaf_b, leaf_a, lanes_b, a_with_b, errors, edges_b, faces_a, edge_face);
  });
}

}  // namespace hpccd::HPCCD_ISA
