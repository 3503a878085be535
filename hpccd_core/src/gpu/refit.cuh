// SPDX-License-Identifier: Apache-2.0
// bvh/refit.cpp on the device: a warp a leaf; the last to arrive at a node carries on to its parent (Karras 2012).
#pragma once

#include "gpu/frame.cuh"

namespace hpccd::gpu {

// Boxes of a leaf's features and, in every lane, of the whole leaf; by one warp.
template <class T>
__device__ DeviceBox refit_leaf(const Frame<T>& f, u32 leaf) {
  const u32 lane = lane_number();
  const DeviceLeaf l = f.leaves[leaf];
  const u32 n_faces = l.counts & 0xFF, n_edges = l.counts >> 8 & 0xFF, n_vertices = l.counts >> 16;
  DeviceBox whole{{INFINITY, INFINITY, INFINITY}, 0, {-INFINITY, -INFINITY, -INFINITY}, 0};
  if (lane < n_faces) {
    DeviceBox& face = f.face_boxes[l.first_face + lane];
    const u32 c0 = face.tag_low, c1 = face.tag_high, c2 = f.face_corner2[l.first_face + lane];
    DeviceBox b = load_box(&f.vertex_boxes[c0]);
    include(b, load_box(&f.vertex_boxes[c1]));
    include(b, load_box(&f.vertex_boxes[c2]));
    b.tag_low = c0, b.tag_high = c1;
    store_box(&face, b);
    include(whole, b);
  }
  if (lane < n_edges) {
    DeviceBox& edge = f.edge_boxes[l.first_edge + lane];
    const u32 v0 = edge.tag_low, v1 = edge.tag_high;
    DeviceBox b = load_box(&f.vertex_boxes[v0]);
    include(b, load_box(&f.vertex_boxes[v1]));
    b.tag_low = v0, b.tag_high = v1;
    store_box(&edge, b);  // inside its triangle's box
  }
  if (lane < n_vertices)  // a lone vertex has no triangle
    include(whole, load_box(&f.vertex_boxes[f.vertex_of_slot[l.first_vertex + lane]]));
  for (int d = 16; d > 0; d /= 2) {
    DeviceBox other;
    for (int k = 0; k < 3; ++k) {
      other.low[k] = __shfl_xor_sync(all_lanes, whole.low[k], d);
      other.high[k] = __shfl_xor_sync(all_lanes, whole.high[k], d);
    }
    include(whole, other);
  }
  whole.tag_low = 0, whole.tag_high = leaf;
  if (lane == 0) store_box(&f.leaf_boxes[leaf], whole);
  return whole;
}

template <class T>
__global__ void refit_leaves_kernel(Frame<T> f) {
  const u32 leaf = (blockIdx.x * blockDim.x + threadIdx.x) / 32;
  if (leaf < f.n_leaves) refit_leaf(f, leaf);
}

template <class T>
__global__ void refit_kernel(Frame<T> f) {
  const u32 leaf = (blockIdx.x * blockDim.x + threadIdx.x) / 32;
  if (leaf >= f.n_leaves) return;
  const DeviceBox whole = refit_leaf(f, leaf);
  if (lane_number() != 0) return;
  u32 node = f.leaf_nodes[leaf];
  store_box(&f.node_boxes[node], whole);
  while (node != 0) {
    node = f.node_parent[node];
    __threadfence();
    if (atomicAdd(&f.node_arrivals[node], 1u) == 0) return;
    __threadfence();
    f.node_arrivals[node] = 0;
    const DeviceBox& own = f.node_boxes[node];
    const u32 child = own.tag_low, last = own.tag_high;
    DeviceBox b = load_box_fresh(&f.node_boxes[child]);
    include(b, load_box_fresh(&f.node_boxes[child + 1]));
    b.tag_low = child, b.tag_high = last;
    store_box(&f.node_boxes[node], b);
  }
}

// Sum of the nodes' half areas (tree.h, relative_area); the root's own is divided out by the host.
template <class T>
__global__ void area_kernel(Frame<T> f) {
  double sum = 0;
  for (u32 i = blockIdx.x * blockDim.x + threadIdx.x; i < f.n_nodes; i += gridDim.x * blockDim.x) {
    const DeviceBox b = load_box(&f.node_boxes[i]);
    const float x = b.high[0] - b.low[0], y = b.high[1] - b.low[1], z = b.high[2] - b.low[2];
    sum += x * y + y * z + z * x;
  }
  for (int d = 16; d > 0; d /= 2) sum += __shfl_xor_sync(all_lanes, sum, d);
  const DeviceBox root = load_box(&f.node_boxes[0]);
  const float x = root.high[0] - root.low[0], y = root.high[1] - root.low[1], z = root.high[2] - root.low[2];
  const float area = x * y + y * z + z * x;
  if (lane_number() == 0 && area > 0) atomicAdd(&f.counters->area, sum / area);
}

}  // namespace hpccd::gpu
