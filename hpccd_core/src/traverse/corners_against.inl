// SPDX-License-Identifier: Apache-2.0
// What is computed once for a corner of one leaf, for all features that have it: on which sides of it the corners of
// another leaf lie, and which features of the other leaf share it, since those are not candidates. (Most pairs of
// leaves are neighbours on a mesh, 60 to 80 % on the published scenes.) A leaf has fewer corners than features. The
// code is branch-free, since which corners are shared is unpredictable. Part of leaf_pairs.inl and leaf_edge_faces.inl.

#include "traverse/leaf_features.inl"

// Some edges and faces of a leaf.
struct FeatureBits {
  std::uint32_t edges, faces;
};
HPCCD_HD FeatureBits operator|(const FeatureBits& a, const FeatureBits& b) {
  return {a.edges | b.edges, a.faces | b.faces};
}

// The features of a leaf that contain a vertex.
HPCCD_HD FeatureBits features_at(const LeafFeatures& leaf, std::uint32_t vertex) {
  unsigned same = equal16(leaf.corners, vertex);
  if (leaf.many) same |= equal16(leaf.corners + 16, vertex) << 16;
  same &= first_bits(leaf.n_corners);  // corners of other leaves follow
  const std::uint32_t all = same ? ~0u : 0, at = static_cast<std::uint32_t>(__builtin_ctz(same | 1u << 31)) & all;
  return {leaf.corners_of->edges_at[at] & all, leaf.corners_of->faces_at[at] & all};
}

// Two leaves of one mesh are neighbours, of two meshes strangers.
enum class LeafPairOf { same, neighbours, strangers };

// Corners of leaf a against all of leaf b, which may be the same.
template <class A, class B, class When>
class CornersAgainst {
 public:
  HPCCD_HD CornersAgainst(When when, const LeafFeatures& a, const LeafFeatures& b, const typename B::Lanes& lanes_b,
                          unsigned corners_a, LeafPairOf leaves)
      : of_(*a.corners_of) {
    const typename A::Boxes boxes(when, a);
    for_each(corners_a, [&](std::uint32_t i) {
      if constexpr (When::grown == Grown::boxes)
        beyond_[i] = Outcodes(b, lanes_b, boxes[i]);
      else
        beyond_[i] = Outcodes(b, lanes_b, when.bounds(boxes[i]));
      shared_[i] = leaves == LeafPairOf::neighbours ? features_at(b, a.corners[i])
                   : leaves == LeafPairOf::same     ? FeatureBits{of_.edges_at[i], of_.faces_at[i]}
                                                    : FeatureBits{};
    });
  }

  // Features of b near a vertex, an edge or a face of a that share no vertex with it.
  HPCCD_HD unsigned faces_near_vertex(const LeafFeatures& b, std::uint32_t i) const {
    return beyond_[i].faces(b) & ~shared_[i].faces;
  }
  HPCCD_HD unsigned edges_near_edge(const LeafFeatures& b, std::uint32_t k) const {
    const std::uint32_t i = of_.edge[0][k], j = of_.edge[1][k];
    return (beyond_[i] & beyond_[j]).edges(b) & ~(shared_[i].edges | shared_[j].edges);
  }
  HPCCD_HD unsigned faces_near_edge(const LeafFeatures& b, std::uint32_t k) const {
    const std::uint32_t i = of_.edge[0][k], j = of_.edge[1][k];
    return (beyond_[i] & beyond_[j]).faces(b) & ~(shared_[i].faces | shared_[j].faces);
  }
  HPCCD_HD unsigned edges_near_face(const LeafFeatures& b, std::uint32_t k) const {
    const std::uint32_t i = of_.face[0][k], j = of_.face[1][k], l = of_.face[2][k];
    return (beyond_[i] & beyond_[j] & beyond_[l]).edges(b) & ~(shared_[i].edges | shared_[j].edges | shared_[l].edges);
  }

 private:
  using Outcodes = typename B::Outcodes;

  const CornersOf& of_;
  Outcodes beyond_[CornersOf::most_corners];
  FeatureBits shared_[CornersOf::most_corners];
};

// The corners of these edges and faces of a leaf.
HPCCD_HD unsigned corners_of(const LeafFeatures& leaf, unsigned edges, unsigned faces) {
  const CornersOf& of = *leaf.corners_of;
  unsigned corners = 0;
  for_each(edges, [&](std::uint32_t k) { corners |= 1u << of.edge[0][k] | 1u << of.edge[1][k]; });
  for_each(faces, [&](std::uint32_t k) { corners |= 1u << of.face[0][k] | 1u << of.face[1][k] | 1u << of.face[2][k]; });
  return corners;
}
