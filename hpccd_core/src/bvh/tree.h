// SPDX-License-Identifier: Apache-2.0
// The merged hierarchy of all meshes (Kim et al. 2009, section 3.2): a binary tree whose leaves hold a few primitives
// each, together with the vertices and edges that these represent, in a layout for tests of many boxes at once.
#pragma once

#include <cstdint>
#include <cstring>
#include <memory>
#include <span>
#include <vector>

#include "base/hd.h"
#include "base/parallel.h"
#include "base/simd/four.h"
#include "bvh/motion_bounds.h"
#include "bvh/motion_box.h"
#include "scene/features.h"
#include "scene/pair_rules.h"

namespace hpccd {

// A reach along the axes, along the slanted directions of a snapshot: they are longer by the root of two, and their
// coordinates twice as large, with roundings to match.
HPCCD_HD float slanted_reach(float reach) { return 1.41422f * reach; }

// One cache line.
struct alignas(64) Node {
  MotionBox box;
  std::uint32_t children = 0;  // the left one; the right one follows. 0: a leaf
  std::uint32_t leaf = 0;      // its number; of an inner node the first one below it
  std::uint32_t mesh = mixed_meshes;
  std::uint32_t primitives : 31 = 0;  // in the whole subtree
  std::uint32_t only_points : 1 = 0;  // no triangle and no edge in it, so nothing that another such node could touch

  bool overlaps(const Node& other) const;  // as MotionBox::overlaps
  // Whether they overlap by more than `excess` along each axis.
  bool overlaps(const Node& other, float excess) const;
  // The same up to a time below 1, from the start on.
  bool overlap_until(const Node& other, float time) const;
  // At the start, no farther apart than `reach` along any axis.
  bool near_at_start(const Node& other, float reach) const;
  // Of one snapshot: no farther apart than `reach` along any axis and any of the slanted directions (kdop.h).
  bool near_in_snapshot(const Node& other, float reach) const;
  // At the start, the square of the Euclidean distance of the boxes.
  float square_of_gap(const Node& other) const;
};
static_assert(sizeof(Node) == 64);

// Four numbers are loaded where three count: the one behind the last bound is `children`.
inline bool Node::overlaps(const Node& other) const {
  const auto below = [](const MotionBox& a, const MotionBox& b) {  // a before b at both ends, by axis
    return (load4(a.t0.high) < load4(b.t0.low)) & (load4(a.t1.high) < load4(b.t1.low));
  };
  return (bits4(below(box, other.box) | below(other.box, box)) & 7) == 0;
}

inline bool Node::overlaps(const Node& other, float excess) const {
  const Floats4 by = {excess, excess, excess, excess};
  const auto below = [&](const MotionBox& a, const MotionBox& b) {
    return (load4(a.t0.high) - by < load4(b.t0.low)) & (load4(a.t1.high) - by < load4(b.t1.low));
  };
  return (bits4(below(box, other.box) | below(other.box, box)) & 7) == 0;
}

// By how much boxes between both ends must be apart, so that the features are. Coordinates, below 2.25 and by a large
// separation below 6.25, are rounded to floats and interpolated in floats: of a gap that leaves 3.1e-6 at most.
inline constexpr float between_ends = 4e-6f;

inline bool Node::overlap_until(const Node& other, float time) const {
  const Floats4 zero{}, by = {between_ends, between_ends, between_ends, between_ends}, t = {time, time, time, time};
  const auto below = [&](const MotionBox& a, const MotionBox& b) {
    const Floats4 gap_t0 = load4(b.t0.low) - load4(a.t0.high), gap_t1 = load4(b.t1.low) - load4(a.t1.high);
    return (gap_t0 > zero) & (gap_t0 + t * (gap_t1 - gap_t0) > by);
  };
  return (bits4(below(box, other.box) | below(other.box, box)) & 7) == 0;
}

inline bool Node::near_at_start(const Node& other, float reach) const {
  const Floats4 by = {reach, reach, reach, reach};
  const Mask4 apart =
      (load4(box.t0.high) + by < load4(other.box.t0.low)) | (load4(other.box.t0.high) + by < load4(box.t0.low));
  return (bits4(apart) & 7) == 0;
}

inline bool Node::near_in_snapshot(const Node& other, float reach) const {
  const float slanted = slanted_reach(reach);
  const Floats4 by = {reach, reach, reach, reach}, by_slanted = {slanted, slanted, slanted, slanted};
  const Mask4 apart = (load4(box.t0.high) + by < load4(other.box.t0.low)) |
                      (load4(other.box.t0.high) + by < load4(box.t0.low)) |
                      (load4(box.t1.high) + by_slanted < load4(other.box.t1.low)) |
                      (load4(other.box.t1.high) + by_slanted < load4(box.t1.low));
  return (bits4(apart) & 7) == 0;
}

inline float Node::square_of_gap(const Node& other) const {
  const Floats4 zero{};
  const Floats4 gap =
      max4(max4(load4(box.t0.low) - load4(other.box.t0.high), load4(other.box.t0.low) - load4(box.t0.high)), zero);
  float along[4];
  std::memcpy(along, &gap, sizeof along);
  return along[0] * along[0] + along[1] * along[1] + along[2] * along[2];
}

// The corners of a leaf are the distinct vertices of its features: nine or ten where eight triangles hang together. All
// that is kept of a leaf's geometry is where they are, a row for each coordinate, sixteen in the lanes of a row; boxes
// of features are made from them where two leaves overlap (leaf_features.inl). That is a quarter of the memory that
// boxes of all features take, and a third of the time to refit them.
struct alignas(64) CornerRow {
  static constexpr std::uint32_t width = 16;
  float lane[width];
};

struct LeafRange {
  std::uint32_t first_face, end_face, first_edge, end_edge, first_vertex, end_vertex;  // slots
  std::uint32_t first_corner = 0, end_corner = 0;
  std::uint32_t first_group = 0;  // of rows: one for every sixteen corners

  HPCCD_HD std::uint32_t n_faces() const { return end_face - first_face; }
  HPCCD_HD std::uint32_t n_edges() const { return end_edge - first_edge; }
  HPCCD_HD std::uint32_t n_vertices() const { return end_vertex - first_vertex; }
  HPCCD_HD std::uint32_t n_corners() const { return end_corner - first_corner; }
  HPCCD_HD std::uint32_t n_groups() const { return (n_corners() + CornerRow::width - 1) / CornerRow::width; }
};

// Which corners of their leaf its features have, by number within the leaf; zeros behind the last. Its vertices are the
// first corners themselves. And the other way round: a bit for each feature that has a corner.
struct alignas(64) CornersOf {
  static constexpr std::uint32_t most_edges = 32, most_faces = 16;  // multiples of CornerRow::width
  static constexpr std::uint32_t most_corners = 24;
  std::uint8_t edge[2][most_edges] = {}, face[3][most_faces] = {};
  std::uint32_t edges_at[most_corners] = {};
  std::uint16_t faces_at[most_corners] = {};
};
static_assert(sizeof(CornersOf) == 256);

// The leaves below one node, up to sixteen of one mesh, with their boxes in lanes, a row for each bound: pairs of
// leaves are looked for sixteen at a time, in place of the last four levels of the tree.
struct alignas(64) Block {
  static constexpr std::uint32_t width = 16;
  float rows[n_bounds][width];
  std::uint32_t node, first_leaf, n_leaves;
};

struct Tree {
  // Primitives of a leaf. With 8, its corners and its edges mostly fill a row each, and each of at most 24 edges has a
  // lane of a GPU's warp.
  static constexpr std::uint32_t leaf_size = 8;
  static constexpr std::uint32_t load_width = CornerRow::width;  // numbers of features are loaded as many at a time
  static_assert(3 * leaf_size <= 2 * CornerRow::width && 3 * leaf_size <= CornersOf::most_edges &&
                leaf_size <= CornersOf::most_faces && 3 * leaf_size <= CornersOf::most_corners);

  std::vector<Node> nodes;  // breadth first: children come after their parents
  static constexpr std::uint32_t none = 0xFFFFFFFFu;

  // A front of subtrees, each within one mesh, that are refitted by one thread each (Kim et al. 2009, section 6), in
  // the order of their leaves. The same for any number of threads, so that sums of areas are.
  struct Subtree {
    std::uint32_t root;
    std::uint32_t above;  // its parent, by number in above_front, or none
    double area = 0;      // sum over its nodes
  };
  std::vector<Subtree> front;
  // The nodes above it. Whoever finishes the second child of one refits that as well.
  struct AboveFront {
    std::uint32_t node;
    std::uint32_t above;  // as in Subtree
    std::uint32_t half_done = 0;
    double area = 0;
  };
  std::vector<AboveFront> above_front;
  std::vector<LeafRange> leaves;
  std::vector<std::uint32_t> leaf_nodes;
  std::vector<Block> blocks;
  std::vector<std::uint32_t> block_of_leaf;
  const Node& node_of_leaf(std::uint32_t leaf) const { return nodes[leaf_nodes[leaf]]; }
  // Whether a node is a block's, or below one.
  static bool in_block(const Node& node) {
    return node.mesh != mixed_meshes && node.primitives <= Block::width * leaf_size;
  }
  // Slots: features in the order of the leaves; each array ends with load_width slots of padding.
  std::vector<std::uint32_t> face_of_slot, edge_of_slot, vertex_of_slot;
  std::vector<std::uint32_t> corners;  // vertex numbers, leaf by leaf: first those of its vertices
  std::vector<CornersOf> corners_of;   // by leaf
  // Of each group a row for each coordinate at both ends; where boxes of vertices are grown these are the low bounds,
  // and the high bounds follow.
  std::unique_ptr<CornerRow[]> rows;
  std::size_t n_groups = 0;
  bool grown = false;
  bool bent = false;  // the hull of a feature's corners need not contain it (squeezed_axis.h)
  static constexpr std::uint32_t coordinates = 6;
  bool by_kdops = false;    // whether there are k-DOPs: for motions only
  std::vector<Kdop> kdops;  // by leaf; they grow like boxes
  HPCCD_HD std::uint32_t rows_per_group() const { return grown ? 2 * coordinates : coordinates; }
  HPCCD_HD CornerRow* rows_of(const LeafRange& leaf) const {
    return rows.get() + std::size_t{leaf.first_group} * rows_per_group();
  }
  double area = 0;  // sum over nodes, relative to the root's: what traversal pays grows with it
  double area_when_built = 0;

  std::size_t bytes() const;
};

// Whether refitting has lost so much that a new tree costs less: traversal visits node pairs about in proportion to the
// nodes' area, and half as much again costs more than a build. Areas relative to the root's.
inline bool worn_out(double area, double area_when_built) { return area > 1.5 * area_when_built; }

// A new tree over the current bounds of the motion of each vertex.
void build(Tree& tree, const Scene& scene, const Features& features, const MotionBounds& motion, ThreadPool& pool);

// The same tree with new bounds, bottom up (Kim et al. 2009, section 6, parallel BVH update). `resting`: by mesh, true
// where vertex boxes are as they were at the last call; empty: of none.
void refit(Tree& tree, const MotionBounds& motion, const std::vector<char>& resting, ThreadPool& pool);

// The boxes of some leaves alone.
void refit_leaves(Tree& tree, const MotionBounds& motion, std::span<const std::uint32_t> leaves, ThreadPool& pool);

}  // namespace hpccd
