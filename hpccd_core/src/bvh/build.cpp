// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <numeric>

#include "bvh/tree.h"

namespace hpccd {
namespace {

struct Centroid {
  float x[3];
};

struct Range {
  std::uint32_t node, begin, end;
};

int widest_axis(const Centroid* centroids, const std::uint32_t* order, std::uint32_t n) {
  float low[3] = {Box::inf, Box::inf, Box::inf}, high[3] = {-Box::inf, -Box::inf, -Box::inf};
  for (std::uint32_t i = 0; i < n; ++i)
    for (int k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], centroids[order[i]].x[k]);
      high[k] = std::max(high[k], centroids[order[i]].x[k]);
    }
  int axis = 0;
  for (int k = 1; k < 3; ++k)
    if (high[k] - low[k] > high[axis] - low[axis]) axis = k;
  return axis;
}

// Puts the `left` lowest along the widest axis first. Ties are ordered by number, so the result is the same everywhere.
void split(const std::vector<Centroid>& centroids, std::uint32_t* order, std::uint32_t n, std::uint32_t left) {
  const int axis = widest_axis(centroids.data(), order, n);
  std::nth_element(order, order + left, order + n, [&](std::uint32_t a, std::uint32_t b) {
    const float xa = centroids[a].x[axis], xb = centroids[b].x[axis];
    return xa < xb || (xa == xb && a < b);
  });
}

Centroid centroid_of(const MotionBox& b) {
  Centroid c;
  for (int k = 0; k < 3; ++k) c.x[k] = (b.t0.low[k] + b.t0.high[k]) + (b.t1.low[k] + b.t1.high[k]);
  return c;
}

class Builder {
 public:
  Builder(Tree& tree, const Scene& scene, const Features& features, const std::vector<MotionBox>& vertex_boxes,
          ThreadPool& pool)
      : tree_(tree), scene_(scene), features_(features), vertex_boxes_(vertex_boxes), pool_(pool) {}

  void run() {
    group_by_mesh();
    split_meshes();
    while (!level_.empty()) split_level();
    lay_out_slots();
    choose_front();
  }

 private:
  MotionBox carrier_box(std::uint32_t c) const {
    if (c >= features_.n_faces()) return vertex_boxes_[features_.lone_vertices[c - features_.n_faces()]];
    MotionBox b;
    for (std::uint32_t v : features_.faces[c]) b.include(vertex_boxes_[v]);
    return b;
  }

  void group_by_mesh() {
    const std::uint32_t n = features_.n_carriers();
    first_of_mesh_.assign(scene_.meshes().size() + 1, 0);
    for (std::uint32_t m : features_.mesh_of_carrier) ++first_of_mesh_[m + 1];
    std::partial_sum(first_of_mesh_.begin(), first_of_mesh_.end(), first_of_mesh_.begin());
    std::vector<std::uint32_t> next(first_of_mesh_.begin(), first_of_mesh_.end() - 1);
    order_.resize(n);
    for (std::uint32_t c = 0; c < n; ++c) order_[next[features_.mesh_of_carrier[c]]++] = c;
    centroids_.resize(n);
    parallel_for(pool_, n, 1024, [&](std::size_t begin, std::size_t end, int) {
      for (std::size_t c = begin; c < end; ++c) centroids_[c] = centroid_of(carrier_box(static_cast<std::uint32_t>(c)));
    });
  }

  Centroid center_of_mesh(std::uint32_t m) const {
    const Scene::Mesh& mesh = scene_.meshes()[m];
    MotionBox b;
    for (std::uint32_t v = mesh.first_vertex; v < mesh.first_vertex + mesh.n_vertices; ++v) b.include(vertex_boxes_[v]);
    return centroid_of(b);
  }

  // Upper part: a tree over whole meshes, so that below it every node belongs to one mesh.
  void split_meshes() {
    const std::size_t n_meshes = scene_.meshes().size();
    const auto is_empty = [&](std::size_t m) { return first_of_mesh_[m] == first_of_mesh_[m + 1]; };
    std::vector<std::uint32_t> meshes;
    for (std::uint32_t m = 0; m < n_meshes; ++m)
      if (!is_empty(m)) meshes.push_back(m);
    std::vector<Centroid> centers(n_meshes);
    if (meshes.size() > 1)
      for (std::uint32_t m : meshes) centers[m] = center_of_mesh(m);
    if (meshes.empty()) return;
    struct MeshRange {
      std::uint32_t node, begin, end;
    };
    tree_.nodes.push_back({});
    std::vector<MeshRange> queue{{0, 0, static_cast<std::uint32_t>(meshes.size())}};
    std::vector<std::uint32_t> node_of_mesh(n_meshes);
    for (std::size_t i = 0; i < queue.size(); ++i) {
      const MeshRange r = queue[i];
      if (r.end - r.begin == 1) {
        node_of_mesh[meshes[r.begin]] = r.node;
        continue;
      }
      const std::uint32_t half = (r.end - r.begin) / 2;
      split(centers, meshes.data() + r.begin, r.end - r.begin, half);
      const std::uint32_t child = add_children(r.node);
      queue.push_back({child, r.begin, r.begin + half});
      queue.push_back({child + 1, r.begin + half, r.end});
    }
    // In the order of the upper tree: neighbours in space are neighbours in memory.
    std::vector<std::uint32_t> order;
    order.reserve(order_.size());
    for (std::uint32_t m : meshes) {
      const auto begin = static_cast<std::uint32_t>(order.size());
      order.insert(order.end(), order_.begin() + first_of_mesh_[m], order_.begin() + first_of_mesh_[m + 1]);
      tree_.nodes[node_of_mesh[m]].mesh = m;
      level_.push_back({node_of_mesh[m], begin, static_cast<std::uint32_t>(order.size())});
    }
    order_.swap(order);
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

  // Left halves take whole leaves, so that leaves are full but for the last of each mesh.
  static std::uint32_t left_size(std::uint32_t n) {
    const std::uint32_t leaves = (n + Tree::leaf_size - 1) / Tree::leaf_size;
    return (leaves + 1) / 2 * Tree::leaf_size;
  }

  void split_level() {
    parallel_for(pool_, level_.size(), 1, [&](std::size_t begin, std::size_t end, int) {
      for (std::size_t i = begin; i < end; ++i) {
        const std::uint32_t n = level_[i].end - level_[i].begin;
        if (n > Tree::leaf_size) split(centroids_, order_.data() + level_[i].begin, n, left_size(n));
      }
    });
    std::vector<Range> next;
    for (const Range& r : level_) {
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
    // Leaves in the order of their carriers: neighbours in space are neighbours in memory.
    std::sort(leaf_ranges_.begin(), leaf_ranges_.end(),
              [](const Range& a, const Range& b) { return a.begin < b.begin; });
    const std::size_t n_leaves = leaf_ranges_.size();
    tree_.leaves.resize(n_leaves);
    tree_.leaf_nodes.resize(n_leaves);
    LeafRange at{};
    for (std::size_t i = 0; i < n_leaves; ++i) tree_.leaves[i] = at = leaf_behind(at, leaf_ranges_[i]);
    // Room behind the last slot, so that a full vector can be loaded anywhere.
    const std::size_t n_faces = at.end_face + Tree::load_width, n_edges = at.end_edge + Tree::load_width,
                      n_vertices = at.end_vertex + Tree::load_width;
    tree_.face_of_slot.resize(n_faces);
    tree_.edge_of_slot.resize(n_edges);
    tree_.vertex_of_slot.resize(n_vertices);
    for (auto& corner : tree_.face_corners) corner.resize(n_faces);
    for (auto& end : tree_.edge_ends) end.resize(n_edges);
    tree_.n_box_groups = n_leaves ? at.end_group() : 0;
    tree_.box_groups = std::make_unique_for_overwrite<BoxGroup[]>(tree_.n_box_groups);
    parallel_for(pool_, n_leaves, 64, [&](std::size_t begin, std::size_t end, int) {
      for (std::size_t i = begin; i < end; ++i) fill_leaf(i);
    });
    for (std::size_t i = tree_.nodes.size(); i-- > 0;)
      if (const auto c = tree_.nodes[i].children) {
        const Node &left = tree_.nodes[c], &right = tree_.nodes[c + 1];
        tree_.nodes[i].carriers = left.carriers + right.carriers;
        tree_.nodes[i].only_points = left.only_points && right.only_points;
      }
  }

  void choose_front() {
    // Enough for any number of threads, and each worth a thread's while.
    const std::uint32_t most = std::max(features_.n_carriers() / 256, 8 * Tree::leaf_size);
    struct Visit {
      std::uint32_t node, above;
    };
    std::vector<Visit> stack;
    if (!tree_.nodes.empty()) stack.push_back({0, Tree::none});
    while (!stack.empty()) {
      const Visit v = stack.back();
      stack.pop_back();
      const Node& node = tree_.nodes[v.node];
      if (node.children && (node.mesh == mixed_meshes || node.carriers > most)) {
        const auto number = static_cast<std::uint32_t>(tree_.above_front.size());
        tree_.above_front.push_back({v.node, v.above});
        stack.push_back({node.children + 1, number});
        stack.push_back({node.children, number});
      } else {
        tree_.front.push_back({v.node, v.above});
      }
    }
  }

  // The slots of a leaf that follows another.
  LeafRange leaf_behind(const LeafRange& before, const Range& r) const {
    LeafRange leaf{before.end_face,   before.end_face,   before.end_edge,   before.end_edge,
                   before.end_vertex, before.end_vertex, before.end_group()};
    for (std::uint32_t i = r.begin; i < r.end; ++i) {
      const std::uint32_t c = order_[i];
      leaf.end_face += c < features_.n_faces();
      leaf.end_edge += features_.first_edge[c + 1] - features_.first_edge[c];
      leaf.end_vertex += features_.first_vertex[c + 1] - features_.first_vertex[c];
    }
    return leaf;
  }

  void fill_leaf(std::size_t i) {
    const Range& r = leaf_ranges_[i];
    Node& node = tree_.nodes[r.node];
    tree_.leaf_nodes[i] = r.node;
    node.leaf = static_cast<std::uint32_t>(i);
    node.carriers = r.end - r.begin;
    const LeafRange& leaf = tree_.leaves[i];
    std::uint32_t face = leaf.first_face, edge = leaf.first_edge, vertex = leaf.first_vertex;
    node.only_points = leaf.n_faces() == 0;
    std::fill(&tree_.box_groups[leaf.first_group], &tree_.box_groups[leaf.end_group()], BoxGroup{});
    std::sort(order_.begin() + r.begin, order_.begin() + r.end);
    for (std::uint32_t k = r.begin; k < r.end; ++k) {
      const std::uint32_t c = order_[k];
      if (c < features_.n_faces()) {
        for (int j = 0; j < 3; ++j) tree_.face_corners[j][face] = features_.faces[c][j];
        tree_.face_of_slot[face++] = c;
      }
      for (auto e = features_.first_edge[c]; e < features_.first_edge[c + 1]; ++e) {
        const std::uint32_t number = features_.owned_edges[e];
        for (int j = 0; j < 2; ++j) tree_.edge_ends[j][edge] = features_.edges[number][j];
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
  std::vector<std::uint32_t> first_of_mesh_, order_;
  std::vector<Centroid> centroids_;
  std::vector<Range> level_, leaf_ranges_;
};

}  // namespace

void build(Tree& tree, const Scene& scene, const Features& features, const std::vector<MotionBox>& vertex_boxes,
           ThreadPool& pool) {
  tree = {};
  Builder(tree, scene, features, vertex_boxes, pool).run();
  refit(tree, vertex_boxes, {}, pool);
  tree.area_when_built = tree.area;
}

}  // namespace hpccd
