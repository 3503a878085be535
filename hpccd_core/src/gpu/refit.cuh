// SPDX-License-Identifier: Apache-2.0
// bvh/refit.cpp on the device: a few lanes per leaf; the last of them that arrive at a node continue with its parent
// (Karras 2012).
#pragma once

#include <cuda/atomic>

#include "gpu/best_time.cuh"

namespace hpccd::gpu {

// Lanes of a leaf: most leaves have nine or ten corners.
inline constexpr u32 refit_lanes = 8;

__device__ inline u32 leaf_of_lanes() { return (blockIdx.x * blockDim.x + threadIdx.x) / refit_lanes; }

// The box of a leaf, in each of its lanes. `leaf` is numbered through all worlds.
template <class T>
__device__ DeviceBox refit_leaf(const LaunchParams<T>& params, u32 leaf, u32 world) {
  const u32 lane = threadIdx.x % refit_lanes, own = leaf - world * params.n_leaves;
  const u32 lanes = ((1u << refit_lanes) - 1) << (lane_number() - lane);
  const DeviceLeaf l = params.leaves[own];
  const Bound top{{INFINITY, INFINITY, INFINITY}, 0}, bottom{{-INFINITY, -INFINITY, -INFINITY}, 0};
  DeviceBox whole{{top, top}, {bottom, bottom}};
  for (u32 i = lane; i < l.n_corners(); i += refit_lanes)
    include(whole, load_point<true>(&params.points[world * params.n_vertices + params.corners[l.first_corner + i]]));
  for (int d = refit_lanes / 2; d > 0; d /= 2) {
    DeviceBox other;
    for (int end = 0; end < 2; ++end)
      for (int k = 0; k < 3; ++k) {
        other.low[end].x[k] = __shfl_xor_sync(lanes, whole.low[end].x[k], d);
        other.high[end].x[k] = __shfl_xor_sync(lanes, whole.high[end].x[k], d);
      }
    include(whole, other);
  }
  whole.tag_low() = 0, whole.tag_high() = own;
  if (lane == 0) store_box(&params.leaf_boxes[leaf], whole);
  return whole;
}

template <class T>
__global__ void refit_leaves_kernel(LaunchParams<T> params) {
  const u32 leaf = leaf_of_lanes();
  if (leaf < params.all_leaves()) refit_leaf(params, leaf, params.by_leaves(leaf));
}

template <class T>
__global__ void refit_kernel(LaunchParams<T> params) {
  const u32 leaf = leaf_of_lanes();
  if (leaf >= params.all_leaves() || over(params)) return;
  const u32 world = params.by_leaves(leaf);
  const DeviceBox whole = refit_leaf(params, leaf, world);
  if (threadIdx.x % refit_lanes != 0) return;
  DeviceBox* boxes = params.node_boxes + static_cast<u64>(world) * params.n_nodes;
  u32* arrivals = params.node_arrivals + static_cast<u64>(world) * params.n_nodes;
  u32 node = params.leaf_nodes[leaf - world * params.n_leaves], parent = params.node_parent[node];
  DeviceBox own = whole;
  store_box(&boxes[node], own);
  while (node != 0) {
    // Loaded before it is known whether they are needed: otherwise each level would wait for them.
    const uint2 links = params.node_links[parent];
    const u32 next = params.node_parent[parent];
    cuda::atomic_ref<u32, cuda::thread_scope_device> arrived(arrivals[parent]);
    if (arrived.fetch_add(1, cuda::memory_order_acq_rel) == 0) return;
    arrivals[parent] = 0;
    include(own, load_box_fresh(&boxes[node == links.x ? links.x + 1 : links.x]));
    own.tag_low() = links.x, own.tag_high() = links.y;
    store_box(&boxes[parent], own);
    node = parent, parent = next;
  }
}

// The mean of both ends, times two (motion_box.h), or the area at the start only.
__device__ inline float area_of(const DeviceBox& b, bool start_alone) {
  float sum = 0;
  for (int end = 0; end < (start_alone ? 1 : 2); ++end) {
    const float *low = b.low[end].x, *high = b.high[end].x;
    const float x = high[0] - low[0], y = high[1] - low[1], z = high[2] - low[2];
    sum += x * y + y * z + z * x;
  }
  return sum;
}

__device__ inline double extent_of(const DeviceBox& b, bool start_alone) {
  double sum = 0;
  for (int end = 0; end < (start_alone ? 1 : 2); ++end)
    for (int k = 0; k < 3; ++k) sum += double{b.high[end].x[k]} - b.low[end].x[k];
  return sum;
}

// As in bvh/refit.cpp: the whole warp, a lane for each edge. `leaf` is numbered through all worlds.
template <class T>
__device__ double looseness_of(const LaunchParams<T>& params, u32 leaf, u32 world) {
  const DeviceLeaf l = params.leaves[leaf - world * params.n_leaves];
  const auto corner = [&](u32 k) {
    const u32 vertex = params.corners[l.first_corner + (k & 0xFF)];
    return load_point<true>(&params.points[world * params.n_vertices + vertex]);
  };
  double edges = 0;
  if (lane_number() < l.n_edges()) {
    const u32 corners = params.leaf_edges[l.first_edge + lane_number()].corners;
    DeviceBox box = corner(corners);
    include(box, corner(corners >> 8));
    edges = extent_of(box, params.until_best);
  }
  for (int d = 16; d > 0; d /= 2) edges += __shfl_xor_sync(all_lanes, edges, d);
  if (!(edges > 0)) return 0;
  const double ratio = extent_of(load_box(&params.leaf_boxes[leaf]), params.until_best) * l.n_edges() / edges;
  return fmin(ratio * ratio, static_cast<double>(params.n_leaves));
}

// Wear, the mean of all worlds. If boxes reach up to an intermediate time, their other end is not used.
template <class T>
__global__ void wear_kernel(LaunchParams<T> params) {
  if (over(params)) return;  // nothing was refitted, so there is no measure
  const u32 stride = Wear::looseness_stride, measured = (params.n_leaves + stride - 1) / stride;
  double sum = 0, loose = 0;
  for (u32 i = (blockIdx.x * blockDim.x + threadIdx.x) / 32; i < params.n_worlds * measured;
       i += gridDim.x * blockDim.x / 32) {
    const u32 world = i / measured;
    loose += looseness_of(params, world * params.n_leaves + (i - world * measured) * stride, world);
  }
  for (u32 i = blockIdx.x * blockDim.x + threadIdx.x; i < params.n_worlds * params.n_nodes;
       i += gridDim.x * blockDim.x) {
    const u32 root = params.by_nodes(i) * params.n_nodes;
    const float area = area_of(load_box(&params.node_boxes[root]), params.until_best);
    if (area > 0) sum += area_of(load_box(&params.node_boxes[i]), params.until_best) / area;
  }
  __syncwarp();
  for (int d = 16; d > 0; d /= 2) sum += __shfl_xor_sync(all_lanes, sum, d);
  if (lane_number() == 0 && sum > 0) atomicAdd(&params.counters->area, sum / params.n_worlds);
  if (lane_number() == 0 && loose > 0)
    atomicAdd(&params.counters->looseness, loose / (static_cast<double>(params.n_worlds) * measured));
}

}  // namespace hpccd::gpu
