// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
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

// The smaller of two values for a low bound, the larger for a high one.
template <std::uint32_t part>
Floats4 join_part(Floats4 a, Floats4 b) {
  const Floats4 low = min4(a, b), high = max4(a, b);
  constexpr auto pick = [](int lane) { return side_of_bound(4 * part + lane) == Side::low ? lane : 4 + lane; };
  return __builtin_shufflevector(low, high, pick(0), pick(1), pick(2), pick(3));
}

Bounds join(const Bounds& a, const Bounds& b) {
  return {{join_part<0>(a.part[0], b.part[0]), join_part<1>(a.part[1], b.part[1]), join_part<2>(a.part[2], b.part[2])}};
}

struct Columns {
  Floats4 row[4];
};
Columns transposed(const Floats4 (&r)[4]) {
  const Floats4 ab_low = __builtin_shufflevector(r[0], r[1], 0, 4, 1, 5),
                ab_high = __builtin_shufflevector(r[0], r[1], 2, 6, 3, 7),
                cd_low = __builtin_shufflevector(r[2], r[3], 0, 4, 1, 5),
                cd_high = __builtin_shufflevector(r[2], r[3], 2, 6, 3, 7);
  return {{__builtin_shufflevector(ab_low, cd_low, 0, 1, 4, 5), __builtin_shufflevector(ab_low, cd_low, 2, 3, 6, 7),
           __builtin_shufflevector(ab_high, cd_high, 0, 1, 4, 5),
           __builtin_shufflevector(ab_high, cd_high, 2, 3, 6, 7)}};
}

// Three coordinates of four corners, from their offset in a box; `skip`: number of corners before them.
template <std::uint32_t skip>
void fill_rows(const MotionBox* const (&corner)[4], std::uint32_t from, CornerRow* rows, std::uint32_t lane) {
  Floats4 r[4];
  for (int j = 0; j < 4; ++j) r[j] = load4(corner[j]->t0.low + from - skip);
  const Columns c = transposed(r);
  for (std::uint32_t k = 0; k < 3; ++k) std::memcpy(&rows[k].lane[lane], &c.row[k + skip], sizeof c.row[k]);
}

// Prefetches the corners of a leaf: hardware does not predict their addresses, and other cores have written there last.
// Saves a tenth of the refit of 18 K triangles on four cores, a fiftieth on one.
void fetch_ahead(const Tree& tree, const LeafRange& leaf, const std::vector<MotionBox>& vertex_boxes) {
  for (std::uint32_t c = leaf.first_corner; c < leaf.end_corner; ++c)
    __builtin_prefetch(&vertex_boxes[tree.corners[c]]);
}

// Rows are filled four corners at a time, and padded with copies. box_of(c): the box of corner c of the tree.
template <class BoxOf>
MotionBox leaf_bounds(const Tree& tree, const LeafRange& leaf, BoxOf&& box_of) {
  constexpr std::uint32_t t1 = n_bounds / 2, high = 3, n = Tree::coordinates;
  Bounds whole = load(MotionBox());
  CornerRow* rows = tree.rows_of(leaf);
  for (std::uint32_t c = leaf.first_corner, lane = 0; c < leaf.end_corner; c += 4, lane += 4) {
    if (lane == CornerRow::width) lane = 0, rows += tree.rows_per_group();
    const MotionBox* corner[4];
    for (std::uint32_t j = 0; j < 4; ++j) {
      corner[j] = c + j < leaf.end_corner ? &box_of(c + j) : corner[j - 1];
      whole = join(whole, load(*corner[j]));
    }
    fill_rows<0>(corner, 0, rows, lane);
    fill_rows<0>(corner, t1, rows + 3, lane);
    if (!tree.grown) continue;
    fill_rows<0>(corner, high, rows + n, lane);
    fill_rows<1>(corner, t1 + high, rows + n + 3, lane);  // not beyond the end of a box
  }
  MotionBox box;
  std::memcpy(static_cast<void*>(&box), &whole, sizeof box);
  return box;
}

// Grows k-DOPs by half a separation on each side, like boxes: leaves with separated k-DOPs then contain no two features
// that come within the separation of each other. The k-DOPs of features are compared with the same margin (KdopMargin).
KdopMargin margin_of(const MotionBounds& motion, std::uint32_t mesh, std::span<const std::uint32_t> vertices) {
  return {motion.kdop_growth(mesh, vertices) + motion.rounding, motion.map.scale};
}

void grow(Kdop& kdop, const KdopMargin& by) {
  for (int k = 0; k < 2 * n_kdop_directions; ++k) kdop.low[k] -= by.in[k], kdop.high[k] += by.in[k];
}

// The bounds at the end then contain those at the start (MotionBounds::of_any_part).
void contain_start(Kdop& kdop) {
  for (int t0 = 0; t0 < n_kdop_directions; ++t0) {
    const int t1 = t0 + n_kdop_directions;
    kdop.low[t1] = std::min(kdop.low[t0], kdop.low[t1]), kdop.high[t1] = std::max(kdop.high[t0], kdop.high[t1]);
  }
}

void join_kdops(Tree& tree, const LeafRange& leaf, const std::vector<VertexKdop>& vertex_kdops) {
  constexpr int parts = 4;
  static_assert(sizeof(VertexKdop) == parts * sizeof(Floats4));
  Floats4 low[parts], high[parts];
  for (std::uint32_t c = leaf.first_corner; c < leaf.end_corner; ++c)
    for (int i = 0; i < parts; ++i) {
      const Floats4 x = load4(vertex_kdops[tree.corners[c]].t0 + 4 * i);
      low[i] = c == leaf.first_corner ? x : min4(low[i], x);
      high[i] = c == leaf.first_corner ? x : max4(high[i], x);
    }
  Kdop& k = tree.kdops[static_cast<std::size_t>(&leaf - tree.leaves.data())];
  std::memcpy(k.low, low, sizeof low);
  std::memcpy(k.high, high, sizeof high);
}

void fit_leaf(Tree& tree, std::uint32_t number, const MotionBounds& motion) {
  const LeafRange& leaf = tree.leaves[number];
  Node& node = tree.nodes[tree.leaf_nodes[number]];
  node.box =
      leaf_bounds(tree, leaf, [&](std::uint32_t c) -> const MotionBox& { return motion.boxes[tree.corners[c]]; });
  if (tree.by_kdops) join_kdops(tree, leaf, motion.kdops);
  if (tree.by_kdops && motion.of_any_part) contain_start(tree.kdops[number]);
  if (tree.by_kdops && motion.grown)
    grow(tree.kdops[number],
         margin_of(motion, node.mesh,
                   std::span(tree.corners).subspan(leaf.first_corner, leaf.end_corner - leaf.first_corner)));
  Block& block = tree.blocks[tree.block_of_leaf[number]];
  float bounds[n_bounds];
  std::memcpy(bounds, &node.box, sizeof bounds);
  for (std::uint32_t i = 0; i < n_bounds; ++i) block.rows[i][number - block.first_leaf] = bounds[i];
}

// Allocates memory for bounds of this kind: with or without separations, of a motion or a snapshot. True if it was
// allocated before.
bool make_room(Tree& tree, const MotionBounds& motion, const Cancellation& cancellation) {
  const bool with_kdops = motion.has_kdops();
  tree.bent = !motion.squeezed.empty();
  const bool same_rows = tree.rows && tree.grown == motion.grown;
  if (same_rows && tree.by_kdops == with_kdops) return true;
  tree.by_kdops = false;  // if memory runs out below
  if (!same_rows) {
    tree.rows.reset();
    tree.grown = motion.grown;
    tree.rows = std::make_unique<CornerRow[]>(tree.n_groups * tree.rows_per_group());
  }
  if (with_kdops) resize(tree.kdops, tree.leaves.size(), cancellation);
  tree.by_kdops = with_kdops;
  return false;
}

void join_children(Tree& tree, Node& node) {
  node.box = tree.nodes[node.children].box;
  node.box.include(tree.nodes[node.children + 1].box);
}

double extent(const Box& b) { return double{b.high[0]} - b.low[0] + b.high[1] - b.low[1] + b.high[2] - b.low[2]; }
double extent(const MotionBox& b) { return extent(b.t0) + extent(b.t1); }

// Of one leaf: the square of its extent relative to that of its edges. (Areas of edges may be zero.)
double looseness(const Tree& tree, std::uint32_t number, const MotionBounds& motion) {
  const LeafRange& leaf = tree.leaves[number];
  const auto& [first, second] = tree.corners_of[number].edge;
  const auto corner = [&](std::uint8_t k) -> const MotionBox& {
    return motion.boxes[tree.corners[leaf.first_corner + k]];
  };
  double edges = 0;
  for (std::uint32_t e = 0; e < leaf.n_edges(); ++e) {
    MotionBox box = corner(first[e]);
    box.include(corner(second[e]));
    edges += extent(box);
  }
  if (!(edges > 0)) return 0;
  const double ratio = extent(tree.node_of_leaf(number).box) * leaf.n_edges() / edges;
  return std::min(ratio * ratio, static_cast<double>(tree.leaves.size()));
}

// Returns the sums over its nodes and leaves.
Wear refit_subtree(Tree& tree, std::uint32_t root, const MotionBounds& motion) {
  Node& node = tree.nodes[root];
  if (!node.children) {
    if (node.leaf + 1 < tree.leaves.size()) fetch_ahead(tree, tree.leaves[node.leaf + 1], motion.boxes);
    fit_leaf(tree, node.leaf, motion);
    const bool measured = node.leaf % Wear::looseness_stride == 0;
    return {node.box.area(), measured ? looseness(tree, node.leaf, motion) : 0};
  }
  Wear sum = refit_subtree(tree, node.children, motion);
  sum += refit_subtree(tree, node.children + 1, motion);
  join_children(tree, node);
  sum.area += node.box.area();
  return sum;
}

// Refits the nodes above a finished subtree: of two siblings the thread that finishes second continues. A serial pass
// over the nodes above the front, whose children other cores have written last, took a tenth of the refit of 18 K
// triangles on four cores.
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

void refit(Tree& tree, const MotionBounds& motion, const std::vector<char>& resting, ThreadPool& pool) {
  const bool same_rows = make_room(tree, motion, pool.cancellation());
  parallel_for(pool, tree.front.size(), 1, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t i = begin; i < end; ++i) {
      Tree::Subtree& subtree = tree.front[i];
      const bool rests = same_rows && !resting.empty() && resting[tree.nodes[subtree.root].mesh];
      if (!rests) subtree.sum = refit_subtree(tree, subtree.root, motion);
      refit_above(tree, subtree.above);
    }
  });
  Wear sum;
  for (const Tree::Subtree& subtree : tree.front) sum += subtree.sum;
  for (const Tree::AboveFront& above : tree.above_front) sum.area += above.area;
  const double root = tree.nodes.empty() ? 0 : tree.nodes[0].box.area();
  const std::size_t measured = (tree.leaves.size() + Wear::looseness_stride - 1) / Wear::looseness_stride;
  tree.wear = root > 0 ? Wear{sum.area / root, sum.looseness / static_cast<double>(measured)} : Wear{};
}

void fit_leaf(Tree& tree, std::uint32_t number, const MotionBox* corner_boxes) {
  const LeafRange& leaf = tree.leaves[number];
  tree.nodes[tree.leaf_nodes[number]].box =
      leaf_bounds(tree, leaf, [&](std::uint32_t c) -> const MotionBox& { return corner_boxes[c - leaf.first_corner]; });
}

void find_least_edges(Tree& tree) {
  if (!tree.least_edge.empty()) return;
  std::vector<std::uint32_t> least(tree.nodes.size(), Tree::none);
  for (std::size_t i = tree.nodes.size(); i-- > 0;) {  // children come after their parents
    const Node& node = tree.nodes[i];
    if (node.children) {
      least[i] = std::min(least[node.children], least[node.children + 1]);
      continue;
    }
    const LeafRange& leaf = tree.leaves[node.leaf];
    for (std::uint32_t slot = leaf.first_edge; slot < leaf.end_edge; ++slot)
      least[i] = std::min(least[i], tree.edge_of_slot[slot]);
  }
  tree.least_edge = std::move(least);
}

void refit_leaves(Tree& tree, const MotionBounds& motion, std::span<const std::uint32_t> leaves, ThreadPool& pool) {
  constexpr std::size_t grain = 64;
  make_room(tree, motion, pool.cancellation());
  parallel_for(pool, leaves.size(), grain, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t i = begin; i < end; ++i) fit_leaf(tree, leaves[i], motion);
  });
}

std::size_t Tree::bytes() const {
  const std::size_t faces = face_of_slot.capacity(), edges = edge_of_slot.capacity(),
                    vertices = vertex_of_slot.capacity();
  return nodes.capacity() * sizeof(Node) + front.capacity() * sizeof(Subtree) +
         above_front.capacity() * sizeof(AboveFront) + leaves.capacity() * (sizeof(LeafRange) + 8) +
         blocks.capacity() * sizeof(Block) + corners_of.capacity() * sizeof(CornersOf) +
         kdops.capacity() * sizeof(Kdop) + (faces + edges + vertices + corners.capacity() + least_edge.capacity()) * 4 +
         n_groups * rows_per_group() * sizeof(CornerRow);
}

}  // namespace hpccd
