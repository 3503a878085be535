// SPDX-License-Identifier: Apache-2.0
// The binary hierarchy of Kim et al. 2009, sections 3.1 and 3.2: all meshes merged, AABBs of the motion, one triangle
// (or one vertex of no triangle) per leaf. Nodes can be split lazily: a node may have its box and its triangles, but
// no children yet.
#pragma once

#include <cstdint>
#include <vector>

#include "base/cancellation.h"
#include "bvh/box.h"
#include "scene/features.h"

namespace hpccd::paper {

using NodeIndex = std::uint32_t;
inline constexpr NodeIndex no_node = 0xFFFFFFFFu;

struct Node {
  Box box;
  std::uint32_t begin = 0, count = 0;  // its primitives: order[begin, begin + count)
  std::uint32_t mesh = 0;              // mixed_meshes if there are several
  std::uint32_t examined = 0;          // step in which its children were last examined (see upkeep.h)
  float culling_when_split = 0;        // see culling_inefficiency
  bool is_split = false;               // its children exist
  bool is_leaf() const { return count == 1; }
};

struct Pair {
  NodeIndex a, b;  // a == b: pairs within the subtree
  bool operator==(const Pair&) const = default;
};

// Nodes in depth-first order. A subtree over m primitives has 2m - 1 contiguous nodes, whatever its shape: splitting a
// node again changes nothing outside its range, so tasks over disjoint subtrees need no locks.
class Hierarchy {
 public:
  std::vector<Node> nodes;           // [0] is the root; empty without primitives
  std::vector<std::uint32_t> order;  // primitives; those of each subtree are contiguous
  std::vector<Box> primitive_boxes;  // by primitive, at the current step

  // From now on start and split throw Cancelled if requested.
  void heed(const Cancellation& cancellation) { cancellation_ = &cancellation; }

  static NodeIndex left(NodeIndex n) { return n + 1; }
  NodeIndex right(NodeIndex n) const { return n + 2 * nodes[n + 1].count; }

  // One node over all primitives, not split. `primitive_boxes` must be current, here and in split.
  void start(const Features& features);

  // Gives a node two new children that are not split themselves: by the median of the triangles' centres along the
  // widest axis (section 6); for a node with several meshes by the median of the meshes, so that each node below has
  // one.
  void split(NodeIndex n, const Features& features);

  std::size_t bytes() const;

 private:
  std::uint32_t split_meshes(const Node& node, const Features& features);
  void make_child(NodeIndex n, std::uint32_t begin, std::uint32_t count, const Features& features);

  const Cancellation* cancellation_ = &never_cancelled;
};

// Surface of the children divided by that of the node (Larsson and Akenine-Möller 2006 compare the same sizes): about 1
// if the children share the node's space, 2 if both fill it. Surface instead of volume, which is zero for flat cloth.
float culling_inefficiency(const Hierarchy& h, NodeIndex split_node);

}  // namespace hpccd::paper
