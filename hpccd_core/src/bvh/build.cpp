// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <memory>

#include "bvh/primitive_box.h"
#include "bvh/split.h"
#include "bvh/tree.h"

namespace hpccd {
namespace {

struct Range {
  std::uint32_t node, begin, end;
};

// A mesh's primitives: their numbers, and their range among those that are split.
struct Part {
  struct Numbers {
    std::uint32_t first, n;
  };
  Numbers faces, lone_edges, lone_vertices;  // ascending in this order
  std::uint32_t node = 0, begin = 0;

  std::uint32_t size() const { return faces.n + lone_edges.n + lone_vertices.n; }
  std::uint32_t place_of(std::uint32_t c) const {
    if (c < faces.first + faces.n) return begin + (c - faces.first);
    if (c < lone_edges.first + lone_edges.n) return begin + faces.n + (c - lone_edges.first);
    return begin + faces.n + lone_edges.n + (c - lone_vertices.first);
  }
};

Centroid centroid_of(const MotionBox& b, std::uint32_t number) {
  Centroid p;
  for (int k = 0; k < 3; ++k) p.center[k] = (b.t0.low[k] + b.t0.high[k]) + (b.t1.low[k] + b.t1.high[k]);
  p.number = number;
  return p;
}

class Builder {
 public:
  Builder(Tree& tree, const Scene& scene, const Features& features, const std::vector<MotionBox>& vertex_boxes,
          ThreadPool& pool)
      : tree_(tree), scene_(scene), features_(features), vertex_boxes_(vertex_boxes), pool_(pool) {}

  void run() {
    find_parts();
    order_meshes();
    place_primitives();
    while (!level_.empty()) split_level();
    lay_out_slots();
    choose_front();
  }

 private:
  void find_parts() {
    // Features sorted by their vertices, and those of a mesh: numbered from first_primitive on.
    const auto numbers = [](const auto& lone, const auto& from, const auto& to, std::uint32_t first_primitive) {
      const auto begin = std::ranges::lower_bound(lone, from), end = std::ranges::lower_bound(lone, to);
      return Part::Numbers{first_primitive + static_cast<std::uint32_t>(begin - lone.begin()),
                           static_cast<std::uint32_t>(end - begin)};
    };
    using Edge = std::array<std::uint32_t, 2>;
    for (const Scene::Mesh& m : scene_.meshes()) {
      const std::uint32_t from = m.first_vertex, to = m.first_vertex + m.n_vertices;
      parts_.push_back({{m.first_face, m.n_faces},
                        numbers(features_.lone_edges, Edge{from, 0}, Edge{to, 0}, features_.first_lone_edge()),
                        numbers(features_.lone_vertices, from, to, features_.first_lone_vertex())});
    }
  }

  Centroid mesh_centroid(std::uint32_t m) const {
    const Scene::Mesh& mesh = scene_.meshes()[m];
    MotionBox b;
    in_pieces(cancellation_, mesh.n_vertices, some, [&](std::size_t begin, std::size_t end) {
      for (std::size_t v = begin; v < end; ++v) b.include(vertex_boxes_[mesh.first_vertex + v]);
    });
    return centroid_of(b, m);
  }

  // Upper part: a tree over whole meshes, so that below it every node belongs to one mesh.
  void order_meshes() {
    std::vector<Centroid> meshes;
    for (std::uint32_t m = 0; m < parts_.size(); ++m)
      if (parts_[m].size() > 0) meshes.push_back({{}, m});
    if (meshes.empty()) return;
    if (meshes.size() > 1)
      for (Centroid& mesh : meshes) mesh = mesh_centroid(mesh.number);
    std::vector<Centroid> scratch(meshes.size());
    tree_.nodes.push_back({});
    std::vector<Range> queue{{0, 0, static_cast<std::uint32_t>(meshes.size())}};
    for (std::size_t i = 0; i < queue.size(); ++i) {
      const Range r = queue[i];
      if (r.end - r.begin == 1) {
        Part& part = parts_[meshes[r.begin].number];
        part.node = r.node;
        tree_.nodes[r.node].mesh = meshes[r.begin].number;
        continue;
      }
      const std::uint32_t half = (r.end - r.begin) / 2;
      split(meshes.data() + r.begin, r.end - r.begin, half, scratch.data());
      const std::uint32_t child = add_children(r.node);
      queue.push_back({child, r.begin, r.begin + half});
      queue.push_back({child + 1, r.begin + half, r.end});
    }
    // In the order of the upper tree, so that neighbours in space are neighbours in memory.
    std::uint32_t begin = 0;
    for (const Centroid& mesh : meshes) {
      Part& part = parts_[mesh.number];
      part.begin = begin;
      begin += part.size();
      level_.push_back({part.node, part.begin, begin});
    }
  }

  void place_primitives() {
    const std::size_t n = features_.n_primitives();
    primitives_ = std::make_unique_for_overwrite<Centroid[]>(n);
    scratch_ = std::make_unique_for_overwrite<Centroid[]>(n);
    parallel_for(pool_, n, 1024, [&](std::size_t begin, std::size_t end, int) {
      for (auto c = static_cast<std::uint32_t>(begin); c < end; ++c)
        primitives_[parts_[features_.mesh_of_primitive[c]].place_of(c)] =
            centroid_of(primitive_box(features_, vertex_boxes_, c), c);
    });
  }

  std::uint32_t add_children(std::uint32_t parent) {
    const auto child = static_cast<std::uint32_t>(tree_.nodes.size());
    const std::uint32_t mesh = tree_.nodes[parent].mesh;
    tree_.nodes[parent].children = child;
    tree_.nodes.push_back({});
    tree_.nodes.push_back({});
    tree_.nodes[child].mesh = tree_.nodes[child + 1].mesh = mesh;
    return child;
  }

  // Left halves get whole leaves, so that all leaves are full except the last of each mesh.
  static std::uint32_t left_size(std::uint32_t n) {
    const std::uint32_t leaves = (n + Tree::leaf_size - 1) / Tree::leaf_size;
    return (leaves + 1) / 2 * Tree::leaf_size;
  }

  void split_level() {
    // A larger range than one thread's share would leave the other threads idle.
    constexpr std::uint32_t worth_sharing = 1 << 14;
    const std::uint32_t share = features_.n_primitives() / static_cast<std::uint32_t>(pool_.size());
    const auto is_shared = [&](const Range& r) {
      return pool_.size() > 1 && r.end - r.begin > std::max(share, worth_sharing);
    };
    for (const Range& r : level_)
      if (is_shared(r))
        split_together(&primitives_[r.begin], r.end - r.begin, left_size(r.end - r.begin), &scratch_[r.begin], pool_);
    parallel_for(pool_, level_.size(), 1, [&](std::size_t begin, std::size_t end, int) {
      for (std::size_t i = begin; i < end; ++i) {
        const Range& r = level_[i];
        const std::uint32_t n = r.end - r.begin;
        if (n > Tree::leaf_size && !is_shared(r))
          split(&primitives_[r.begin], n, left_size(n), &scratch_[r.begin], cancellation_);
      }
    });
    std::vector<Range> next;
    for (const Range& r : level_) {
      cancellation_.heed();
      const std::uint32_t n = r.end - r.begin;
      if (n <= Tree::leaf_size) {
        leaf_ranges_.push_back(r);
        continue;
      }
      const std::uint32_t child = add_children(r.node);
      next.push_back({child, r.begin, r.begin + left_size(n)});
      next.push_back({child + 1, r.begin + left_size(n), r.end});
    }
    level_.swap(next);
  }

  void lay_out_slots() {
    // Leaves in the order of their primitives, so that neighbours in space are neighbours in memory.
    std::sort(leaf_ranges_.begin(), leaf_ranges_.end(),
              heeding(cancellation_, [](const Range& a, const Range& b) { return a.begin < b.begin; }));
    const std::size_t n_leaves = leaf_ranges_.size();
    const auto make_room = [this](auto& slots, std::size_t n) { resize(slots, n, cancellation_); };
    make_room(tree_.leaves, n_leaves);
    make_room(tree_.leaf_nodes, n_leaves);
    make_room(tree_.corners_of, n_leaves);
    parallel_for(pool_, n_leaves, 64, [&](std::size_t begin, std::size_t end, int) {
      for (std::size_t i = begin; i < end; ++i) tree_.leaves[i] = size_of_leaf(leaf_ranges_[i]);
    });
    LeafRange at{};
    in_pieces(cancellation_, n_leaves, some, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) tree_.leaves[i] = at = leaf_behind(at, tree_.leaves[i]);
    });
    // Padding after the last slot, so that a full vector can be loaded anywhere.
    make_room(tree_.face_of_slot, at.end_face + Tree::load_width);
    make_room(tree_.edge_of_slot, at.end_edge + Tree::load_width);
    make_room(tree_.vertex_of_slot, at.end_vertex + Tree::load_width);
    make_room(tree_.corners, at.end_corner + 2 * Tree::load_width);
    tree_.n_groups = n_leaves ? at.first_group + at.n_groups() : 0;
    parallel_for(pool_, n_leaves, 64, [&](std::size_t begin, std::size_t end, int) {
      for (std::size_t i = begin; i < end; ++i) fill_leaf(i);
    });
    const std::size_t n_nodes = tree_.nodes.size();
    in_pieces(cancellation_, n_nodes, some, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = n_nodes - begin; i-- > n_nodes - end;)
        if (const auto c = tree_.nodes[i].children) {
          const Node &left = tree_.nodes[c], &right = tree_.nodes[c + 1];
          tree_.nodes[i].primitives = left.primitives + right.primitives;
          tree_.nodes[i].only_points = left.only_points && right.only_points;
          tree_.nodes[i].leaf = left.leaf;
        }
    });
    gather_blocks(n_leaves);
  }

  // Blocks in the order of their leaves.
  void gather_blocks(std::size_t n_leaves) {
    resize(tree_.block_of_leaf, n_leaves, cancellation_);
    // A node with more than sixteen leaves has two children with at least eight.
    tree_.blocks.reserve(n_leaves / (Block::width / 2) + scene_.meshes().size());
    std::vector<std::uint32_t> stack;
    if (!tree_.nodes.empty()) stack.push_back(0);
    while (!stack.empty()) {
      cancellation_.heed();
      const std::uint32_t at = stack.back();
      stack.pop_back();
      const Node& node = tree_.nodes[at];
      if (!Tree::in_block(node)) {
        stack.push_back(node.children + 1);
        stack.push_back(node.children);
        continue;
      }
      const std::uint32_t n = (node.primitives + Tree::leaf_size - 1) / Tree::leaf_size;
      std::fill_n(&tree_.block_of_leaf[node.leaf], n, static_cast<std::uint32_t>(tree_.blocks.size()));
      Block& block = tree_.blocks.emplace_back();
      block.node = at, block.first_leaf = node.leaf, block.n_leaves = n;
    }
  }

  void choose_front() {
    // Enough subtrees for any number of threads, each large enough to be worth a thread's time.
    const std::uint32_t most = std::max(features_.n_primitives() / 256, 8 * Tree::leaf_size);
    struct Visit {
      std::uint32_t node, above;
    };
    std::vector<Visit> stack;
    if (!tree_.nodes.empty()) stack.push_back({0, Tree::none});
    while (!stack.empty()) {
      const Visit v = stack.back();
      stack.pop_back();
      const Node& node = tree_.nodes[v.node];
      if (node.children && (node.mesh == mixed_meshes || node.primitives > most)) {
        const auto number = static_cast<std::uint32_t>(tree_.above_front.size());
        tree_.above_front.push_back({v.node, v.above});
        stack.push_back({node.children + 1, number});
        stack.push_back({node.children, number});
      } else {
        tree_.front.push_back({v.node, v.above});
      }
    }
  }

  // The distinct vertices of a leaf, starting with those that it represents.
  class Corners {
   public:
    std::uint8_t add(std::uint32_t vertex) {
      const auto at = static_cast<std::uint8_t>(std::find(list_, list_ + n_, vertex) - list_);
      if (at == n_) list_[n_++] = vertex;
      return at;
    }
    std::uint32_t size() const { return n_; }
    const std::uint32_t* begin() const { return list_; }

   private:
    std::uint8_t n_ = 0;
    std::uint32_t list_[3 * Tree::leaf_size];
  };

  Corners corners_of(const Range& r) const {
    Corners corners;
    for (std::uint32_t i = r.begin; i < r.end; ++i) {
      const std::uint32_t c = primitives_[i].number;
      for (auto v = features_.first_vertex[c]; v < features_.first_vertex[c + 1]; ++v)
        corners.add(features_.owned_vertices[v]);
    }
    for (std::uint32_t i = r.begin; i < r.end; ++i) {
      const std::uint32_t c = primitives_[i].number;
      if (c < features_.n_faces())
        for (const std::uint32_t v : features_.faces[c]) corners.add(v);
      else if (c < features_.first_lone_vertex())
        for (const std::uint32_t v : features_.lone_edges[c - features_.first_lone_edge()]) corners.add(v);
    }
    return corners;
  }

  // The slots of a leaf, as if it were the first.
  LeafRange size_of_leaf(const Range& r) const {
    LeafRange leaf{};
    for (std::uint32_t i = r.begin; i < r.end; ++i) {
      const std::uint32_t c = primitives_[i].number;
      leaf.end_face += c < features_.n_faces();
      leaf.end_edge += features_.first_edge[c + 1] - features_.first_edge[c];
      leaf.end_vertex += features_.first_vertex[c + 1] - features_.first_vertex[c];
    }
    leaf.end_corner = corners_of(r).size();
    return leaf;
  }

  static LeafRange leaf_behind(const LeafRange& before, const LeafRange& size) {
    return {before.end_face,
            before.end_face + size.end_face,
            before.end_edge,
            before.end_edge + size.end_edge,
            before.end_vertex,
            before.end_vertex + size.end_vertex,
            before.end_corner,
            before.end_corner + size.end_corner,
            before.first_group + before.n_groups()};
  }

  void fill_leaf(std::size_t i) {
    const Range& r = leaf_ranges_[i];
    Node& node = tree_.nodes[r.node];
    tree_.leaf_nodes[i] = r.node;
    node.leaf = static_cast<std::uint32_t>(i);
    node.primitives = r.end - r.begin;
    const LeafRange& leaf = tree_.leaves[i];
    std::uint32_t face = leaf.first_face, edge = leaf.first_edge, vertex = leaf.first_vertex;
    node.only_points = leaf.n_faces() == 0 && leaf.n_edges() == 0;
    std::sort(&primitives_[r.begin], &primitives_[r.end],
              [](const Centroid& a, const Centroid& b) { return a.number < b.number; });
    Corners corners = corners_of(r);
    std::copy_n(corners.begin(), corners.size(), &tree_.corners[leaf.first_corner]);
    CornersOf& corners_of = tree_.corners_of[i] = {};
    for (std::uint32_t p = r.begin; p < r.end; ++p) {
      const std::uint32_t c = primitives_[p].number;
      if (c < features_.n_faces()) {
        const std::uint32_t k = face - leaf.first_face;
        for (int j = 0; j < 3; ++j) {
          const std::uint8_t corner = corners_of.face[j][k] = corners.add(features_.faces[c][j]);
          corners_of.faces_at[corner] |= static_cast<std::uint16_t>(1u << k);
        }
        tree_.face_of_slot[face++] = c;
      }
      for (auto e = features_.first_edge[c]; e < features_.first_edge[c + 1]; ++e) {
        const std::uint32_t number = features_.owned_edges[e];
        const std::uint32_t k = edge - leaf.first_edge;
        for (int j = 0; j < 2; ++j) {
          const std::uint8_t corner = corners_of.edge[j][k] = corners.add(features_.edges[number][j]);
          corners_of.edges_at[corner] |= 1u << k;
        }
        tree_.edge_of_slot[edge++] = number;
      }
      for (auto v = features_.first_vertex[c]; v < features_.first_vertex[c + 1]; ++v)
        tree_.vertex_of_slot[vertex++] = features_.owned_vertices[v];
    }
  }

  Tree& tree_;
  const Scene& scene_;
  const Features& features_;
  const std::vector<MotionBox>& vertex_boxes_;
  ThreadPool& pool_;
  const Cancellation& cancellation_ = pool_.cancellation();
  static constexpr std::size_t some = 1 << 15;  // piece size of the serial work: less than 1 ms
  std::vector<Part> parts_;                     // by mesh
  std::unique_ptr<Centroid[]> primitives_;      // in the order of the tree, as far as it has been split
  std::unique_ptr<Centroid[]> scratch_;         // scratch memory of the splits
  std::vector<Range> level_, leaf_ranges_;
};

}  // namespace

void build(Tree& tree, const Scene& scene, const Features& features, const MotionBounds& motion, ThreadPool& pool) {
  tree = {};
  Builder(tree, scene, features, motion.boxes, pool).run();
  refit(tree, motion, {}, pool);
  tree.wear_when_built = tree.wear;
}

}  // namespace hpccd
