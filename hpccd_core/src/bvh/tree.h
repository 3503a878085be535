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

// A reach along the slanted directions of a snapshot: they are longer than the axes by the root of two, and their
// coordinates are twice as large, with corresponding rounding errors.
HPCCD_HD float slanted_reach(float reach) { return 1.41422f * reach; }

// One cache line.
struct alignas(64) Node {
  MotionBox box;
  std::uint32_t children = 0;  // the left child; the right one follows it. 0: a leaf
  std::uint32_t leaf = 0;      // number of the leaf; of an inner node, of the first leaf below it
  std::uint32_t mesh = mixed_meshes;
  std::uint32_t primitives : 31 = 0;  // number of primitives in the whole subtree
  std::uint32_t only_points : 1 = 0;  // contains no triangle and no edge, so no pair of such nodes can touch

  bool overlaps(const Node& other) const;  // see MotionBox::overlaps
  // Whether they overlap by more than `excess` along each axis.
  bool overlaps(const Node& other, float excess) const;
  // The same up to a time below 1, from the start of the motion.
  bool overlap_until(const Node& other, float time) const;
  // Whether the boxes at the start are at most `reach` apart along every axis.
  bool near_at_start(const Node& other, float reach) const;
  // For one snapshot: at most `reach` apart along every axis and all slanted directions (kdop.h).
  bool near_in_snapshot(const Node& other, float reach) const;
  // The square of the Euclidean distance of the boxes at the start.
  float square_of_gap(const Node& other) const;
};
static_assert(sizeof(Node) == 64);

// Loads four numbers where three are used: the one after the last bound is `children`.
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

// The gap between interpolated boxes that proves that the features are apart. Coordinates, below 2.25 and with a large
// separation below 6.25, are rounded to floats and interpolated in floats: the error of a gap is at most 3.1e-6.
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

// The corners of a leaf are the distinct vertices of its features: nine or ten if eight triangles are connected. Their
// positions are the only geometry of a leaf that is stored: a row for each coordinate, with sixteen corners in the
// lanes of a row. Boxes of features are computed from them when two leaves overlap (leaf_features.inl). This takes a
// quarter of the memory of boxes of all features, and a third of the time to refit them.
struct alignas(64) CornerRow {
  static constexpr std::uint32_t width = 16;
  float lane[width];
};

struct LeafRange {
  std::uint32_t first_face, end_face, first_edge, end_edge, first_vertex, end_vertex;  // slots
  std::uint32_t first_corner = 0, end_corner = 0;
  std::uint32_t first_group = 0;  // index of rows: one for every sixteen corners

  HPCCD_HD std::uint32_t n_faces() const { return end_face - first_face; }
  HPCCD_HD std::uint32_t n_edges() const { return end_edge - first_edge; }
  HPCCD_HD std::uint32_t n_vertices() const { return end_vertex - first_vertex; }
  HPCCD_HD std::uint32_t n_corners() const { return end_corner - first_corner; }
  HPCCD_HD std::uint32_t n_groups() const { return (n_corners() + CornerRow::width - 1) / CornerRow::width; }
};

// The corners of each feature of a leaf, by number within the leaf, padded with zeros. Its vertices are the first
// corners themselves. And the inverse: for each corner, one bit for each feature that has it.
struct alignas(64) CornersOf {
  static constexpr std::uint32_t most_edges = 32, most_faces = 16;  // multiples of CornerRow::width
  static constexpr std::uint32_t most_corners = 24;
  std::uint8_t edge[2][most_edges] = {}, face[3][most_faces] = {};
  std::uint32_t edges_at[most_corners] = {};
  std::uint16_t faces_at[most_corners] = {};
};
static_assert(sizeof(CornersOf) == 256);

// The leaves below one node, up to sixteen of one mesh, with their boxes in lanes, a row for each bound: pairs of
// leaves are searched sixteen at a time, in place of the last four levels of the tree.
struct alignas(64) Block {
  static constexpr std::uint32_t width = 16;
  float rows[n_bounds][width];
  std::uint32_t node, first_leaf, n_leaves;
};

// What a search of the tree costs, in two measures that do not depend on the scene's size.
struct Wear {
  // Sum of the areas of all nodes, relative to the root's: the cost of traversal grows with it.
  double area = 0;
  // Area of the box of a leaf relative to that of its features, which is about the number of leaves that it overlaps:
  // the mean of every 256th leaf, so that measuring it takes less than a hundredth of the time of a refit.
  double looseness = 0;
  static constexpr std::uint32_t looseness_stride = 256;

  Wear& operator+=(const Wear& other) {
    area += other.area, looseness += other.looseness;
    return *this;
  }
};

// Whether refitting has degraded the tree so much that a new one costs less. The number of visited node pairs is about
// proportional to the nodes' area, and half as much again costs more than a build. A tree that was built while a mesh
// was torn apart has so large an area that it never grows by half: once the mesh is whole again, its leaves are loose.
// It is 12 to 47 in generated and published scenes, whose trees refitting has degraded or not, and less where boxes
// have grown by a separation; hence the constant.
inline bool worn_out(const Wear& now, const Wear& when_built) {
  return now.area > 1.5 * when_built.area || now.looseness > 4 * when_built.looseness + 64;
}

struct Tree {
  // Primitives of a leaf. With 8, its corners and its edges mostly fill one row each, and each of at most 24 edges has
  // a lane of a GPU's warp.
  static constexpr std::uint32_t leaf_size = 8;
  static constexpr std::uint32_t load_width = CornerRow::width;  // number of feature indices that are loaded at once
  static_assert(3 * leaf_size <= 2 * CornerRow::width && 3 * leaf_size <= CornersOf::most_edges &&
                leaf_size <= CornersOf::most_faces && 3 * leaf_size <= CornersOf::most_corners);

  std::vector<Node> nodes;  // breadth first: children come after their parents
  static constexpr std::uint32_t none = 0xFFFFFFFFu;

  // A front of subtrees, each within one mesh, that are refitted by one thread each (Kim et al. 2009, section 6), in
  // the order of their leaves. It does not depend on the number of threads, so neither do sums of areas.
  struct Subtree {
    std::uint32_t root;
    std::uint32_t above;  // its parent, by number in above_front, or none
    Wear sum{};           // over its nodes and leaves
  };
  std::vector<Subtree> front;
  // The nodes above the front. The thread that finishes the second child of a node refits that node as well.
  struct AboveFront {
    std::uint32_t node;
    std::uint32_t above;  // see Subtree
    std::uint32_t half_done = 0;
    double area = 0;
  };
  std::vector<AboveFront> above_front;
  std::vector<LeafRange> leaves;
  std::vector<std::uint32_t> leaf_nodes;
  std::vector<Block> blocks;
  std::vector<std::uint32_t> block_of_leaf;
  const Node& node_of_leaf(std::uint32_t leaf) const { return nodes[leaf_nodes[leaf]]; }
  // Whether a node is a block, or below one.
  static bool in_block(const Node& node) {
    return node.mesh != mixed_meshes && node.primitives <= Block::width * leaf_size;
  }
  // Slots: features in the order of the leaves; each array ends with load_width slots of padding.
  std::vector<std::uint32_t> face_of_slot, edge_of_slot, vertex_of_slot;
  std::vector<std::uint32_t> corners;  // vertex numbers, leaf by leaf, starting with the leaf's own vertices
  std::vector<CornersOf> corners_of;   // by leaf
  // For each group, a row for each coordinate at both ends. If boxes of vertices have grown, these are the low bounds,
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
  // Starts to load what a test of a leaf reads first: its bounds, corners and features.
  void prefetch(std::uint32_t leaf) const {
    const LeafRange& range = leaves[leaf];
    const auto lines = [](const void* at, std::size_t bytes) {
      for (std::size_t i = 0; i < bytes; i += 64) __builtin_prefetch(static_cast<const char*>(at) + i);
    };
    lines(rows_of(range), rows_per_group() * sizeof(CornerRow));
    lines(&corners_of[leaf], sizeof(CornersOf));
    lines(&corners[range.first_corner], 64), lines(&edge_of_slot[range.first_edge], 64);
    lines(&face_of_slot[range.first_face], 32), lines(&nodes[leaf_nodes[leaf]], sizeof(Node));
  }
  std::vector<std::uint32_t> least_edge;  // by node, the lowest number of an edge below; empty until it is needed
  Wear wear, wear_when_built;

  std::size_t bytes() const;
};

// Builds a new tree over the current bounds of the motion of each vertex.
void build(Tree& tree, const Scene& scene, const Features& features, const MotionBounds& motion, ThreadPool& pool);

// Updates the bounds of the same tree, bottom up (Kim et al. 2009, section 6, parallel BVH update). `resting`: by mesh,
// whether vertex boxes are unchanged since the previous call; empty: no mesh.
void refit(Tree& tree, const MotionBounds& motion, const std::vector<char>& resting, ThreadPool& pool);

// Fills Tree::least_edge, once for each tree.
void find_least_edges(Tree& tree);

// Updates the box and the rows of a leaf for one snapshot, from the boxes of its corners in their order.
void fit_leaf(Tree& tree, std::uint32_t leaf, const MotionBox* corner_boxes);

// Updates the boxes of some leaves only.
void refit_leaves(Tree& tree, const MotionBounds& motion, std::span<const std::uint32_t> leaves, ThreadPool& pool);

}  // namespace hpccd
