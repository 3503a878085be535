// SPDX-License-Identifier: Apache-2.0
// The tree on the device: its topology, and this frame's boxes of all nodes.
#pragma once

#include <algorithm>
#include <vector>

#include "bvh/tree.h"
#include "gpu/device_leaves.cuh"
#include "gpu/traverse.cuh"

namespace hpccd::gpu {

class DeviceTree {
 public:
  // Throws Error where it is deeper than the device's traversal goes.
  void set(const Features& features, const Tree& tree) {
    n_ = 0;  // no tree, should anything below fail
    const std::size_t n = tree.nodes.size();
    std::vector<u32> parent(n, 0), mesh(n), last_leaf(n, 0), depth(n, 0);
    std::vector<DeviceBox> boxes(n);
    for (std::size_t i = n; i-- > 0;) {
      const Node& node = tree.nodes[i];
      mesh[i] = node.mesh == mixed_meshes ? no_mesh : node.mesh;
      if (node.children) parent[node.children] = parent[node.children + 1] = static_cast<u32>(i);
      last_leaf[i] = node.children ? std::max(last_leaf[node.children], last_leaf[node.children + 1]) : node.leaf;
      boxes[i].tag_low() = node.children, boxes[i].tag_high() = last_leaf[i];
    }
    u32 deepest = 0;
    for (std::size_t i = 1; i < n; ++i) deepest = std::max(deepest, depth[i] = depth[parent[i]] + 1);
    if (deepest > traverse_depth) throw Error("the tree is too deep for the device; use backend=\"cpu\"");
    upload(boxes_, boxes.data(), n);
    upload(mesh_, mesh.data(), n);
    upload(parent_, parent.data(), n);
    arrivals_.reserve(std::max<std::size_t>(n, 1));
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
    params.node_boxes = boxes_.data(), params.node_mesh = mesh_.data(), params.node_parent = parent_.data();
    params.node_arrivals = arrivals_.data(), params.leaf_nodes = leaf_nodes_.data();
  }

  std::size_t bytes() const { return boxes_.bytes() + leaves_.bytes(); }

 private:
  u32 n_ = 0;
  DeviceLeaves leaves_;
  DeviceBuffer<DeviceBox> boxes_;
  DeviceBuffer<u32> mesh_, parent_, arrivals_, leaf_nodes_;
};

}  // namespace hpccd::gpu
