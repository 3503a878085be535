// SPDX-License-Identifier: Apache-2.0
// The tree on the device: its topology, and the boxes of all nodes in this frame, in each world.
#pragma once

#include <algorithm>
#include <vector>

#include "bvh/tree.h"
#include "gpu/device_leaves.cuh"
#include "gpu/traverse.cuh"

namespace hpccd::gpu {

class DeviceTree {
 public:
  explicit DeviceTree(u32 n_worlds) : n_worlds_(n_worlds), leaves_(n_worlds) {}

  // Throws Error if the tree is too deep for the device's traversal.
  void set(const Features& features, const Tree& tree) {
    n_ = 0;  // no tree, if anything below fails
    const std::size_t n = tree.nodes.size();
    std::vector<u32> parent(n, 0), mesh(n), depth(n, 0);
    std::vector<uint2> links(n);
    for (std::size_t i = n; i-- > 0;) {
      const Node& node = tree.nodes[i];
      mesh[i] = node.mesh == mixed_meshes ? no_mesh : node.mesh;
      if (node.children) parent[node.children] = parent[node.children + 1] = static_cast<u32>(i);
      links[i] = {node.children,
                  node.children ? std::max(links[node.children].y, links[node.children + 1].y) : node.leaf};
    }
    u32 deepest = 0;
    for (std::size_t i = 1; i < n; ++i) deepest = std::max(deepest, depth[i] = depth[parent[i]] + 1);
    if (n > most_nodes) throw Error("the tree is too large for the device; use backend=\"cpu\"");
    if (deepest > traverse_depth) throw Error("the tree is too deep for the device; use backend=\"cpu\"");
    const std::size_t in_all = std::max<std::size_t>(n * n_worlds_, 1);
    boxes_.reserve(in_all);
    upload(links_, links.data(), n);
    upload(mesh_, mesh.data(), n);
    upload(parent_, parent.data(), n);
    arrivals_.reserve(in_all);
    check(cudaMemset(arrivals_.data(), 0, arrivals_.bytes()), "cudaMemset");
    upload(leaf_nodes_, tree.leaf_nodes.data(), tree.leaves.size());
    leaves_.set(features, tree.leaves, tree.face_of_slot, tree.edge_of_slot, tree.vertex_of_slot);
    n_ = static_cast<u32>(n);
  }

  bool empty() const { return leaves_.size() == 0; }

  template <class T>
  void fill(LaunchParams<T>& params) const {
    leaves_.fill(params);
    params.n_nodes = n_;
    params.by_nodes = n_worlds_ > 1 ? Division::by(n_) : Division{0};
    params.node_links = links_.data(), params.node_mesh = mesh_.data(), params.node_parent = parent_.data();
    params.leaf_nodes = leaf_nodes_.data();
    params.node_boxes = boxes_.data(), params.node_arrivals = arrivals_.data();
  }

  std::size_t bytes() const {
    return boxes_.bytes() + leaves_.bytes() + links_.bytes() + mesh_.bytes() + parent_.bytes() + arrivals_.bytes() +
           leaf_nodes_.bytes();
  }

 private:
  const u32 n_worlds_;
  u32 n_ = 0;
  DeviceLeaves leaves_;
  DeviceBuffer<uint2> links_;
  DeviceBuffer<DeviceBox> boxes_;
  DeviceBuffer<u32> mesh_, parent_, arrivals_, leaf_nodes_;
};

}  // namespace hpccd::gpu
