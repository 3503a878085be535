// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <cstring>

#include "bvh/tree.h"

namespace hpccd {
namespace {

// A motion's box in registers: the twelve bounds in their order (bound_number).
struct Bounds {
  Floats4 part[3];
};

Bounds load(const MotionBox& b) {
  Bounds r;
  static_assert(sizeof r == sizeof b);
  std::memcpy(&r, &b, sizeof r);
  return r;
}

// The smaller of two where the bound is a low one, else the larger.
template <std::uint32_t part>
Floats4 join_part(Floats4 a, Floats4 b) {
  const Floats4 low = min4(a, b), high = max4(a, b);
  constexpr auto pick = [](int lane) { return side_of_bound(4 * part + lane) == Side::low ? lane : 4 + lane; };
  return __builtin_shufflevector(low, high, pick(0), pick(1), pick(2), pick(3));
}

Bounds join(const Bounds& a, const Bounds& b) {
  return {{join_part<0>(a.part[0], b.part[0]), join_part<1>(a.part[1], b.part[1]), join_part<2>(a.part[2], b.part[2])}};
}

// Boxes of n features in a leaf's groups, four at a time, from a lane on that is a multiple of four; the last ones are
// filled up with copies.
template <class BoxOf>
void fill(BoxGroup* groups, std::uint32_t lane, std::uint32_t n, BoxOf&& box_of) {
  for (std::uint32_t i = 0; i < n; i += 4, lane += 4) {
    Bounds b[4];
    for (std::uint32_t j = 0; j < 4; ++j) b[j] = i + j < n ? box_of(i + j) : b[j - 1];
    auto& rows = groups[lane / BoxGroup::width].rows;
    for (std::uint32_t part = 0; part < 3; ++part) {
      const Floats4 ab_low = __builtin_shufflevector(b[0].part[part], b[1].part[part], 0, 4, 1, 5),
                    ab_high = __builtin_shufflevector(b[0].part[part], b[1].part[part], 2, 6, 3, 7),
                    cd_low = __builtin_shufflevector(b[2].part[part], b[3].part[part], 0, 4, 1, 5),
                    cd_high = __builtin_shufflevector(b[2].part[part], b[3].part[part], 2, 6, 3, 7);
      const Floats4 row[4] = {
          __builtin_shufflevector(ab_low, cd_low, 0, 1, 4, 5), __builtin_shufflevector(ab_low, cd_low, 2, 3, 6, 7),
          __builtin_shufflevector(ab_high, cd_high, 0, 1, 4, 5), __builtin_shufflevector(ab_high, cd_high, 2, 3, 6, 7)};
      for (std::uint32_t k = 0; k < 4; ++k)
        std::memcpy(&rows[4 * part + k][lane % BoxGroup::width], &row[k], sizeof row[k]);
    }
  }
}

// Where the vertices of a leaf lie the processor cannot guess, and other cores have written there last: a tenth of the
// refit of 18 K triangles on four cores, a fiftieth on one. To fetch the groups of boxes ahead as well brought nothing.
void fetch_ahead(const Tree& tree, const LeafRange& leaf, const std::vector<MotionBox>& vertex_boxes) {
  for (std::uint32_t s = leaf.first_face; s < leaf.end_face; ++s)
    for (const auto& corner : tree.face_corners) __builtin_prefetch(&vertex_boxes[corner[s]]);
}

MotionBox leaf_bounds(const Tree& tree, const LeafRange& leaf, const std::vector<MotionBox>& vertex_boxes) {
  Bounds whole = load(MotionBox());
  const auto vertex_box = [&](std::uint32_t v) { return load(vertex_boxes[v]); };
  fill(&tree.box_groups[leaf.surface_group()], 0, leaf.n_faces(), [&](std::uint32_t i) {
    const std::uint32_t s = leaf.first_face + i;
    const Bounds b = join(join(vertex_box(tree.face_corners[0][s]), vertex_box(tree.face_corners[1][s])),
                          vertex_box(tree.face_corners[2][s]));
    whole = join(whole, b);
    return b;
  });
  const std::uint32_t n_edges = tree.fits_edges ? leaf.n_edges() : 0;
  fill(&tree.box_groups[leaf.first_group], 0, n_edges, [&](std::uint32_t i) {
    const std::uint32_t s = leaf.first_edge + i;
    return join(vertex_box(tree.edge_ends[0][s]), vertex_box(tree.edge_ends[1][s]));  // inside its triangle's box
  });
  fill(&tree.box_groups[leaf.surface_group()], leaf.first_vertex_lane(), leaf.n_vertices(), [&](std::uint32_t i) {
    const Bounds b = vertex_box(tree.vertex_of_slot[leaf.first_vertex + i]);
    whole = join(whole, b);  // a lone vertex has no triangle
    return b;
  });
  MotionBox box;
  std::memcpy(static_cast<void*>(&box), &whole, sizeof box);
  return box;
}

void join_children(Tree& tree, Node& node) {
  node.box = tree.nodes[node.children].box;
  node.box.include(tree.nodes[node.children + 1].box);
}

// Returns the sum of the areas of its nodes.
double refit_subtree(Tree& tree, std::uint32_t root, const std::vector<MotionBox>& vertex_boxes) {
  Node& node = tree.nodes[root];
  if (!node.children) {
    if (node.leaf + 1 < tree.leaves.size()) fetch_ahead(tree, tree.leaves[node.leaf + 1], vertex_boxes);
    node.box = leaf_bounds(tree, tree.leaves[node.leaf], vertex_boxes);
    return node.box.area();
  }
  const double left = refit_subtree(tree, node.children, vertex_boxes);
  const double right = refit_subtree(tree, node.children + 1, vertex_boxes);
  join_children(tree, node);
  return left + right + node.box.area();
}

// Up from a subtree that is done: of two siblings whoever comes second goes on. A serial pass over the nodes above the
// front, whose children other cores have written last, took a tenth of the refit of 18 K triangles on four cores.
void refit_above(Tree& tree, std::uint32_t number) {
  while (number != Tree::none) {
    Tree::AboveFront& above = tree.above_front[number];
    const std::atomic_ref half_done(above.half_done);
    if (!half_done.exchange(1, std::memory_order_acq_rel)) return;
    half_done.store(0, std::memory_order_relaxed);
    Node& node = tree.nodes[above.node];
    join_children(tree, node);
    above.area = node.box.area();
    number = above.above;
  }
}

}  // namespace

void refit(Tree& tree, const std::vector<MotionBox>& vertex_boxes, const std::vector<char>& resting, ThreadPool& pool) {
  parallel_for(pool, tree.front.size(), 1, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t i = begin; i < end; ++i) {
      Tree::Subtree& subtree = tree.front[i];
      const bool rests = !resting.empty() && resting[tree.nodes[subtree.root].mesh];
      if (!rests) subtree.area = refit_subtree(tree, subtree.root, vertex_boxes);
      refit_above(tree, subtree.above);
    }
  });
  double area = 0;
  for (const Tree::Subtree& subtree : tree.front) area += subtree.area;
  for (const Tree::AboveFront& above : tree.above_front) area += above.area;
  const double root = tree.nodes.empty() ? 0 : tree.nodes[0].box.area();
  tree.area = root > 0 ? area / root : 0;
}

void refit_leaves(Tree& tree, const std::vector<MotionBox>& vertex_boxes, std::span<const std::uint32_t> leaves,
                  ThreadPool& pool) {
  constexpr std::size_t grain = 64;
  parallel_for(pool, leaves.size(), grain, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t i = begin; i < end; ++i)
      tree.nodes[tree.leaf_nodes[leaves[i]]].box = leaf_bounds(tree, tree.leaves[leaves[i]], vertex_boxes);
  });
}

std::size_t Tree::bytes() const {
  const std::size_t faces = face_of_slot.capacity(), edges = edge_of_slot.capacity(),
                    vertices = vertex_of_slot.capacity();
  return nodes.capacity() * sizeof(Node) + front.capacity() * sizeof(Subtree) +
         above_front.capacity() * sizeof(AboveFront) + leaves.capacity() * (sizeof(LeafRange) + 4) + faces * 16 +
         edges * 12 + vertices * 4 + n_box_groups * sizeof(BoxGroup);
}

}  // namespace hpccd
