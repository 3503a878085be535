// SPDX-License-Identifier: Apache-2.0
// Memory of the search for nearest features. The nearest pairs of a frame stay on the device as the first bounds of the
// next one.
#pragma once

#include <algorithm>
#include <vector>

#include "gpu/nearest_launch.cuh"
#include "gpu/stream.h"

namespace hpccd::gpu {

class DeviceNearest {
 public:
  explicit DeviceNearest(u32 n_worlds) : n_worlds_(n_worlds) {}

  void set(const Tree& tree) {
    levels_ = 0, uploaded_ = false;
    const std::size_t n = tree.nodes.size();
    std::vector<NodeContent> contents(n), leaf_contents(tree.leaves.size());
    std::vector<u32> height(n, 0);
    of_meshes_.clear();
    for (std::size_t i = n; i-- > 0;) {  // children come after their parents
      const Node& node = tree.nodes[i];
      NodeContent& in = contents[i];
      if (node.children) {
        const NodeContent &a = contents[node.children], &b = contents[node.children + 1];
        in = {std::min(a.least_edge, b.least_edge), a.kinds | b.kinds};
        height[i] = std::max(height[node.children], height[node.children + 1]) + 1;
      } else {
        in = leaf_contents[node.leaf] = of_leaf(tree, tree.leaves[node.leaf]);
      }
      if (node.mesh == mixed_meshes) continue;
      levels_ = std::max(levels_, height[i]);
      if (of_meshes_.size() <= node.mesh) of_meshes_.resize(node.mesh + 1, {no_node, 0, 0});
      SubtreeOfMesh& of = of_meshes_[node.mesh];
      of.root = static_cast<u32>(i), of.first_leaf = node.leaf;  // that of the highest node in the end
      of.n_leaves += node.children == 0;
    }
    upload(contents_, contents.data(), n), upload(leaf_contents_, leaf_contents.data(), leaf_contents.size());
  }

  template <class T>
  NearestTask task(const std::vector<PairToSearch>& pairs, u64 version, const LaunchParams<T>& params) {
    const auto n = static_cast<u32>(pairs.size()), all = n * n_worlds_;
    if (!uploaded_ || version_ != version) upload_meshes(pairs), version_ = version, uploaded_ = true;
    so_far_.reserve_filled(all, 0xFF);  // no pairs
    results_.reserve(all), host_results_.reserve(all);
    counters_.reserve(1), host_counters_.reserve(1);
    const std::size_t leaves = std::size_t{params.n_leaves} * n_worlds_;
    for (DeviceBuffer<uint4>& nodes : nodes_) nodes.reserve(std::max<std::size_t>({leaves, all, 1u << 16}));
    leaves_.reserve(std::max<std::size_t>(2 * leaves, 1u << 16));
    if (n_within_ > 0) samples_.reserve(std::size_t{2} * samples_of_mesh * n_within_ * n_worlds_);
    undecided_.reserve(1024), undecided_results_.reserve(undecided_.size());
    NearestTask t{};
    t.n_pairs = n, t.n_all = all;
    t.meshes = meshes_.data(), t.contents = contents_.data(), t.leaf_contents = leaf_contents_.data(),
    t.so_far = so_far_.data();
    for (int i = 0; i < 2; ++i) t.nodes[i] = nodes_[i].data();
    t.leaves = leaves_.data(), t.samples = samples_.data(), t.undecided = undecided_.data();
    t.node_capacity = std::min(nodes_[0].size(), nodes_[1].size()), t.leaf_capacity = leaves_.size();
    t.sample_capacity = samples_.size(), t.undecided_capacity = undecided_.size();
    t.counters = counters_.data(), t.results = results_.data(), t.undecided_results = undecided_results_.data();
    return t;
  }
  u32 levels() const { return levels_; }
  bool within_meshes() const { return n_within_ > 0; }

  void copy_results(const NearestTask& task, cudaStream_t stream) {
    fetch(host_counters_.data(), task.counters, 1, stream);
    fetch(host_results_.data(), task.results, task.n_all, stream);
  }

  enum class Room { enough, grown, too_little };
  // After the frame: enlarges lists that were too short, up to a size with which CPUs are faster.
  Room grow() {
    const NearestCounters& c = *host_counters_.data();
    const u64 most_nodes = *std::max_element(std::begin(c.nodes), std::end(c.nodes));
    if (std::max({most_nodes, c.leaves, c.undecided << 6}) > most_pairs) return Room::too_little;
    Room room = Room::enough;
    const auto fit = [&](auto& list, u64 n) {
      if (n <= list.size()) return;
      list.reserve(n + n / 4);
      room = Room::grown;
    };
    for (DeviceBuffer<uint4>& nodes : nodes_) fit(nodes, most_nodes);
    fit(leaves_, c.leaves), fit(undecided_, c.undecided), undecided_results_.reserve(undecided_.size());
    return room;
  }

  NearestPairsFound found(const NearestTask& task, cudaStream_t stream) {
    NearestPairsFound r;
    r.of_meshes.assign(host_results_.data(), host_results_.data() + task.n_all);
    r.undecided.resize(host_counters_.data()->undecided);
    if (r.undecided.empty()) return r;
    fetch(r.undecided.data(), task.undecided_results, r.undecided.size(), stream);
    check(cudaStreamSynchronize(stream), "cudaStreamSynchronize");
    return r;
  }

  // Vertices of the frame and the meshes around which their winding numbers are asked.
  InsideTask ask(const std::vector<VertexInMesh>& vertices, cudaStream_t stream) {
    const std::size_t n = std::max<std::size_t>(vertices.size(), 1);
    asked_.reserve(n), host_asked_.reserve(n), numbers_.reserve(n);
    for (std::size_t i = 0; i < vertices.size(); ++i)
      host_asked_.data()[i] = {vertices[i].world, vertices[i].vertex, of_meshes_.at(vertices[i].mesh).root};
    check(cudaMemcpyAsync(asked_.data(), host_asked_.data(), vertices.size() * sizeof(VertexAndMesh),
                          cudaMemcpyHostToDevice, stream),
          "cudaMemcpyAsync");
    return {static_cast<u32>(vertices.size()), asked_.data(), numbers_.data()};
  }
  std::vector<std::int32_t> numbers(const InsideTask& task, cudaStream_t stream) {
    std::vector<std::int32_t> numbers(task.n);
    fetch(numbers.data(), task.numbers, task.n, stream);
    check(cudaStreamSynchronize(stream), "cudaStreamSynchronize");
    return numbers;
  }

  const NearestCounters& counters() const { return *host_counters_.data(); }
  std::size_t bytes() const {
    return contents_.bytes() + leaf_contents_.bytes() + meshes_.bytes() + so_far_.bytes() + nodes_[0].bytes() +
           nodes_[1].bytes() + leaves_.bytes() + samples_.bytes() + undecided_.bytes() + results_.bytes() +
           undecided_results_.bytes() + counters_.bytes() + asked_.bytes() + numbers_.bytes();
  }

 private:
  struct SubtreeOfMesh {
    u32 root, first_leaf, n_leaves;
  };
  // Half a gigabyte for each list; a search that needs more is that of boxes which hardly distinguish features.
  static constexpr u64 most_pairs = u64{1} << 25;

  static NodeContent of_leaf(const Tree& tree, const LeafRange& leaf) {
    NodeContent in{Tree::none, (leaf.n_faces() ? NodeContent::faces : 0) | (leaf.n_edges() ? NodeContent::edges : 0)};
    const CornersOf& corners = tree.corners_of[&leaf - tree.leaves.data()];
    for (u32 i = 0; i < leaf.n_corners(); ++i)
      if (!corners.edges_at[i] && !corners.faces_at[i]) in.kinds |= NodeContent::isolated_vertices;
    for (u32 slot = leaf.first_edge; slot < leaf.end_edge; ++slot)
      in.least_edge = std::min(in.least_edge, tree.edge_of_slot[slot]);
    return in;
  }

  void upload_meshes(const std::vector<PairToSearch>& pairs) {
    std::vector<SearchedMeshes> meshes;
    n_within_ = 0;
    const auto of = [&](u32 mesh) {
      return mesh < of_meshes_.size() ? of_meshes_[mesh] : SubtreeOfMesh{no_node, 0, 0};
    };
    for (const PairToSearch& p : pairs) {
      const SubtreeOfMesh a = of(p.mesh_a), b = of(p.mesh_b);
      const bool same = p.mesh_a == p.mesh_b;
      n_within_ += same;
      meshes.push_back({a.root, b.root, a.first_leaf, a.n_leaves, same, !same && !p.filtered, p.thickest, p.most_lack});
    }
    upload(meshes_, meshes.data(), meshes.size());
  }

  template <class V>
  static void fetch(V* to, const V* from, std::size_t n, cudaStream_t stream) {
    check(cudaMemcpyAsync(to, from, n * sizeof(V), cudaMemcpyDeviceToHost, stream), "cudaMemcpyAsync");
  }

  const u32 n_worlds_;
  u32 levels_ = 0, n_within_ = 0;
  bool uploaded_ = false;
  u64 version_ = 0;
  std::vector<SubtreeOfMesh> of_meshes_;
  DeviceBuffer<NodeContent> contents_, leaf_contents_;
  DeviceBuffer<SearchedMeshes> meshes_;
  DeviceBuffer<NearestSoFar> so_far_;
  DeviceBuffer<uint4> nodes_[2], leaves_, samples_, undecided_;
  DeviceBuffer<VertexAndMesh> asked_;
  PinnedBuffer<VertexAndMesh> host_asked_;
  DeviceBuffer<std::int32_t> numbers_;
  DeviceBuffer<NearestOfMeshes> results_;
  PinnedBuffer<NearestOfMeshes> host_results_;
  DeviceBuffer<UndecidedNearest> undecided_results_;
  DeviceBuffer<NearestCounters> counters_;
  PinnedBuffer<NearestCounters> host_counters_;
};

}  // namespace hpccd::gpu
