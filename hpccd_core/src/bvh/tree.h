// SPDX-License-Identifier: Apache-2.0
// The merged hierarchy of all meshes (Kim et al. 2009, section 3.2): a binary tree whose leaves hold a few triangles
// each, together with the vertices and edges these represent, laid out for tests of many boxes at once.
#pragma once

#include <cstdint>
#include <vector>

#include "base/parallel.h"
#include "bvh/box.h"
#include "scene/features.h"

namespace hpccd {

inline constexpr std::uint32_t mixed_meshes = 0xFFFFFFFFu;

struct Node {
  Box box;
  std::uint32_t children = 0;  // the left one; the right one follows. 0: a leaf
  std::uint32_t leaf = 0;      // where a leaf: its number
  std::uint32_t mesh = mixed_meshes;
  std::uint32_t carriers = 0;  // in the whole subtree
  bool only_points = false;    // no triangle in the whole subtree, so nothing that another such node could touch
};

// Boxes of features in the order of the leaves.
struct BoxArrays {
  std::vector<float> low[3], high[3];
  void resize(std::size_t n) {
    for (int k = 0; k < 3; ++k) low[k].resize(n), high[k].resize(n);
  }
  void set(std::size_t i, const Box& b) {
    for (int k = 0; k < 3; ++k) low[k][i] = b.low[k], high[k][i] = b.high[k];
  }
};

struct LeafRange {
  std::uint32_t first_face, end_face, first_edge, end_edge, first_vertex, end_vertex;  // slots
};

struct Tree {
  static constexpr std::uint32_t leaf_size = 8;
  static constexpr std::uint32_t load_width = 16;  // boxes are compared 16 at a time

  std::vector<Node> nodes;  // breadth first: children come after their parents
  // nodes[level_begin[i] .. level_begin[i + 1]) have their children on the next level; on the first, which joins whole
  // meshes, also on the same one.
  std::vector<std::uint32_t> level_begin;
  std::vector<LeafRange> leaves;
  std::vector<std::uint32_t> leaf_nodes;
  // Slots: features in the order of the leaves; each array ends with load_width slots of padding.
  std::vector<std::uint32_t> face_of_slot, edge_of_slot, vertex_of_slot;
  std::vector<std::uint32_t> face_corners[3], edge_ends[2];  // vertex numbers by slot
  BoxArrays face_boxes, edge_boxes, vertex_boxes;
  double area_when_built = 0;  // sum over nodes, relative to the root's

  std::size_t bytes() const;
};

// A new tree over the current vertex boxes (bounds of the motion of each vertex).
void build(Tree& tree, const Scene& scene, const Features& features, const std::vector<Box>& vertex_boxes,
           ThreadPool& pool);

// The same tree with new bounds, bottom up (Kim et al. 2009, section 6, parallel BVH update). `resting`: by mesh, true
// where vertex boxes are as they were at the last call; empty: of none.
void refit(Tree& tree, const std::vector<Box>& vertex_boxes, const std::vector<char>& resting, ThreadPool& pool);

// Sum of the nodes' areas over the root's: what traversal pays grows with it.
double relative_area(const Tree& tree, ThreadPool& pool);

}  // namespace hpccd
