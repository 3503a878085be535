// SPDX-License-Identifier: Apache-2.0
// Features of two leaves that share a vertex: they are not candidates. Most pairs of leaves are neighbours on a mesh
// (60 to 80 % on the published scenes), so shared vertices are found once per pair of leaves, not per pair of
// features. The code is branch-free, since which corners are shared is unpredictable. Part of leaf_pairs.inl and
// leaf_edge_faces.inl.

#include "traverse/leaf_features.inl"

// The features of a leaf that contain a vertex, if it is one of these corners of the leaf.
struct FeaturesAt {
  std::uint32_t corner;  // a vertex, or a number that no leaf has
  std::uint32_t edges, faces;

  HPCCD_HD FeaturesAt(const LeafFeatures& leaf, unsigned corners, std::uint32_t vertex) {
    unsigned same = equal16(leaf.corners, vertex);
    if (leaf.many) same |= equal16(leaf.corners + 16, vertex) << 16;
    same &= corners;
    const std::uint32_t number = static_cast<std::uint32_t>(__builtin_ctz(same | 1u << none)), all = same ? ~0u : 0,
                        at = number & all;
    corner = number, edges = leaf.corners_of->edges_at[at] & all, faces = leaf.corners_of->faces_at[at] & all;
  }
  static constexpr std::uint32_t none = 31;
  static_assert(none >= CornersOf::most_corners);
};

// For each corner of one leaf, the features of another leaf that contain it.
struct Sharing {
  std::uint32_t edges[FeaturesAt::none + 1] = {}, faces[FeaturesAt::none + 1] = {};
  HPCCD_HD void set(std::uint32_t corner, std::uint32_t with_edges, std::uint32_t with_faces) {
    edges[corner] = with_edges, faces[corner] = with_faces;
  }
};

// Finds the vertices that two leaves share, among these corners of each.
HPCCD_HD void find_shared(const LeafFeatures& a, unsigned corners_a, const LeafFeatures& b, unsigned corners_b,
                          Sharing& a_with_b, Sharing& b_with_a) {
  for_each(corners_a, [&](std::uint32_t i) {
    const FeaturesAt of_b(b, corners_b, a.corners[i]);
    a_with_b.set(i, of_b.edges, of_b.faces);
    b_with_a.set(of_b.corner, a.corners_of->edges_at[i], a.corners_of->faces_at[i]);
  });
}

// The same for a leaf and itself.
HPCCD_HD void find_own(const LeafFeatures& leaf, Sharing& own) {
  for (std::uint32_t i = 0; i < leaf.n_corners; ++i)
    own.set(i, leaf.corners_of->edges_at[i], leaf.corners_of->faces_at[i]);
}
