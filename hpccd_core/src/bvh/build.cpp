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

Centroid centroid_of(const Box& b) { return {{b.low[0] + b.high[0], b.low[1] + b.high[1], b.low[2] + b.high[2]}}; }

class Builder {
 public:
  Builder(Tree& tree, const Scene& scene, const Features& features, const std::vector<Box>& vertex_boxes,
          ThreadPool& pool)
      : tree_(tree), scene_(scene), features_(features), vertex_boxes_(vertex_boxes), pool_(pool) {}

  void run() {
    carriers_of_mesh();
    split_meshes();
    tree_.level_begin = {0};
    while (!level_.empty()) split_level();
    lay_out_slots();
  }

 private:
  Box carrier_box(std::uint32_t c) const {
    if (c >= features_.n_faces()) return vertex_boxes_[features_.lone_vertices[c - features_.n_faces()]];
    Box b;
    for (std::uint32_t v : features_.faces[c]) b.include(vertex_boxes_[v]);
    return b;
  }

  void carriers_of_mesh() {
    const std::uint32_t n = features_.n_carriers();
    order_.resize(n);
    std::iota(order_.begin(), order_.end(), 0);
    std::stable_sort(order_.begin(), order_.end(), [&](std::uint32_t a, std::uint32_t b) {
      return features_.mesh_of_carrier[a] < features_.mesh_of_carrier[b];
    });
    centroids_.resize(n);
    parallel_for(pool_, n, 4096, [&](std::size_t begin, std::size_t end, int) {
      for (std::size_t c = begin; c < end; ++c) centroids_[c] = centroid_of(carrier_box(static_cast<std::uint32_t>(c)));
    });
  }

  // Upper part: a tree over whole meshes, so that below it every node belongs to one mesh.
  void split_meshes() {
    std::vector<std::vector<std::uint32_t>> carriers(scene_.meshes().size());
    for (std::uint32_t c : order_) carriers[features_.mesh_of_carrier[c]].push_back(c);
    std::vector<std::uint32_t> meshes;
    std::vector<Centroid> centers(carriers.size());
    for (std::uint32_t m = 0; m < carriers.size(); ++m) {
      if (carriers[m].empty()) continue;
      Box b;
      for (std::uint32_t c : carriers[m]) b.include(carrier_box(c));
      centers[m] = centroid_of(b);
      meshes.push_back(m);
    }
    if (meshes.empty()) return;
    struct MeshRange {
      std::uint32_t node, begin, end;
    };
    tree_.nodes.push_back({});
    std::vector<MeshRange> queue{{0, 0, static_cast<std::uint32_t>(meshes.size())}};
    std::vector<std::uint32_t> node_of_mesh(carriers.size());
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
    std::uint32_t at = 0;
    for (std::uint32_t m : meshes) {
      const auto begin = at;
      for (std::uint32_t c : carriers[m]) order_[at++] = c;
      tree_.nodes[node_of_mesh[m]].mesh = m;
      level_.push_back({node_of_mesh[m], begin, at});
    }
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
    tree_.level_begin.push_back(static_cast<std::uint32_t>(tree_.nodes.size()));
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
    for (const Range& r : leaf_ranges_) {
      LeafRange leaf{};
      leaf.first_face = static_cast<std::uint32_t>(tree_.face_of_slot.size());
      leaf.first_edge = static_cast<std::uint32_t>(tree_.edge_of_slot.size());
      leaf.first_vertex = static_cast<std::uint32_t>(tree_.vertex_of_slot.size());
      std::sort(order_.begin() + r.begin, order_.begin() + r.end);
      for (std::uint32_t i = r.begin; i < r.end; ++i) {
        const std::uint32_t c = order_[i];
        if (c < features_.n_faces()) tree_.face_of_slot.push_back(c);
        for (auto e = features_.first_edge[c]; e < features_.first_edge[c + 1]; ++e)
          tree_.edge_of_slot.push_back(features_.owned_edges[e]);
        for (auto v = features_.first_vertex[c]; v < features_.first_vertex[c + 1]; ++v)
          tree_.vertex_of_slot.push_back(features_.owned_vertices[v]);
      }
      leaf.end_face = static_cast<std::uint32_t>(tree_.face_of_slot.size());
      leaf.end_edge = static_cast<std::uint32_t>(tree_.edge_of_slot.size());
      leaf.end_vertex = static_cast<std::uint32_t>(tree_.vertex_of_slot.size());
      Node& node = tree_.nodes[r.node];
      node.leaf = static_cast<std::uint32_t>(tree_.leaves.size());
      node.carriers = r.end - r.begin;
      node.only_points = leaf.first_face == leaf.end_face;
      tree_.leaves.push_back(leaf);
      tree_.leaf_nodes.push_back(r.node);
    }
    for (std::size_t i = tree_.nodes.size(); i-- > 0;)
      if (const auto c = tree_.nodes[i].children) {
        const Node &left = tree_.nodes[c], &right = tree_.nodes[c + 1];
        tree_.nodes[i].carriers = left.carriers + right.carriers;
        tree_.nodes[i].only_points = left.only_points && right.only_points;
      }

    // Room behind the last slot, so that a full vector can be loaded anywhere.
    const auto pad = Tree::load_width;
    const auto n_faces = tree_.face_of_slot.size(), n_edges = tree_.edge_of_slot.size(),
               n_vertices = tree_.vertex_of_slot.size();
    for (int k = 0; k < 3; ++k) {
      tree_.face_corners[k].assign(n_faces + pad, 0);
      for (std::size_t s = 0; s < n_faces; ++s) tree_.face_corners[k][s] = features_.faces[tree_.face_of_slot[s]][k];
    }
    for (int k = 0; k < 2; ++k) {
      tree_.edge_ends[k].assign(n_edges + pad, 0);
      for (std::size_t s = 0; s < n_edges; ++s) tree_.edge_ends[k][s] = features_.edges[tree_.edge_of_slot[s]][k];
    }
    tree_.face_of_slot.resize(n_faces + pad);
    tree_.edge_of_slot.resize(n_edges + pad);
    tree_.vertex_of_slot.resize(n_vertices + pad);
    tree_.face_boxes.resize(n_faces + pad);
    tree_.edge_boxes.resize(n_edges + pad);
    tree_.vertex_boxes.resize(n_vertices + pad);
  }

  Tree& tree_;
  const Scene& scene_;
  const Features& features_;
  const std::vector<Box>& vertex_boxes_;
  ThreadPool& pool_;
  std::vector<std::uint32_t> order_;
  std::vector<Centroid> centroids_;
  std::vector<Range> level_, leaf_ranges_;
};

}  // namespace

void build(Tree& tree, const Scene& scene, const Features& features, const std::vector<Box>& vertex_boxes,
           ThreadPool& pool) {
  tree = {};
  Builder(tree, scene, features, vertex_boxes, pool).run();
  refit(tree, vertex_boxes, {}, pool);
  tree.area_when_built = relative_area(tree, pool);
}

}  // namespace hpccd
