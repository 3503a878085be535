// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <numeric>

#include "bvh/tree.h"

namespace hpccd {
namespace {

Box leaf_bounds(Tree& tree, const LeafRange& leaf, const std::vector<Box>& vertex_boxes) {
  Box whole;
  for (std::uint32_t s = leaf.first_face; s < leaf.end_face; ++s) {
    Box b = vertex_boxes[tree.face_corners[0][s]];
    b.include(vertex_boxes[tree.face_corners[1][s]]);
    b.include(vertex_boxes[tree.face_corners[2][s]]);
    tree.face_boxes.set(s, b);
    whole.include(b);
  }
  for (std::uint32_t s = leaf.first_edge; s < leaf.end_edge; ++s) {
    Box b = vertex_boxes[tree.edge_ends[0][s]];
    b.include(vertex_boxes[tree.edge_ends[1][s]]);
    tree.edge_boxes.set(s, b);  // inside its triangle's box
  }
  for (std::uint32_t s = leaf.first_vertex; s < leaf.end_vertex; ++s) {
    const Box& b = vertex_boxes[tree.vertex_of_slot[s]];
    tree.vertex_boxes.set(s, b);
    whole.include(b);  // a lone vertex has no triangle
  }
  return whole;
}

}  // namespace

void refit(Tree& tree, const std::vector<Box>& vertex_boxes, const std::vector<char>& resting, ThreadPool& pool) {
  const auto rests = [&](const Node& node) {
    return !resting.empty() && node.mesh != mixed_meshes && resting[node.mesh];
  };
  parallel_for(pool, tree.leaves.size(), 32, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t i = begin; i < end; ++i) {
      Node& node = tree.nodes[tree.leaf_nodes[i]];
      if (!rests(node)) node.box = leaf_bounds(tree, tree.leaves[i], vertex_boxes);
    }
  });
  const auto join_children = [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = end; i-- > begin;) {
      Node& node = tree.nodes[i];
      if (!node.children || rests(node)) continue;
      node.box = tree.nodes[node.children].box;
      node.box.include(tree.nodes[node.children + 1].box);
    }
  };
  // A level this small is done before other threads have noticed.
  constexpr std::size_t small = 1024;
  for (std::size_t level = tree.level_begin.size(); level-- > 0;) {
    const std::size_t first = tree.level_begin[level];
    const std::size_t n =
        (level + 1 < tree.level_begin.size() ? tree.level_begin[level + 1] : tree.nodes.size()) - first;
    if (level == 0)
      join_children(first, first + n);
    else
      parallel_for(pool, n, small,
                   [&](std::size_t begin, std::size_t end, int) { join_children(first + begin, first + end); });
  }
}

std::size_t Tree::bytes() const {
  const std::size_t faces = face_of_slot.capacity(), edges = edge_of_slot.capacity(),
                    vertices = vertex_of_slot.capacity();
  return nodes.capacity() * sizeof(Node) + leaves.capacity() * (sizeof(LeafRange) + 4) + faces * (16 + sizeof(Box)) +
         edges * (12 + sizeof(Box)) + vertices * (4 + sizeof(Box));
}

double relative_area(const Tree& tree, ThreadPool& pool) {
  if (tree.nodes.empty()) return 0;
  // Added piece by piece in a fixed order: when a tree is rebuilt must not depend on the number of threads.
  constexpr std::size_t piece = 2048;
  std::vector<double> sums((tree.nodes.size() + piece - 1) / piece, 0);
  parallel_for(pool, sums.size(), 1, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t i = begin; i < end; ++i)
      for (std::size_t k = i * piece; k < std::min((i + 1) * piece, tree.nodes.size()); ++k)
        sums[i] += tree.nodes[k].box.half_area();
  });
  const double root = tree.nodes[0].box.half_area();
  return root > 0 ? std::accumulate(sums.begin(), sums.end(), 0.0) / root : 0;
}

}  // namespace hpccd
