// SPDX-License-Identifier: Apache-2.0
// bvh/refit.cpp on the device: a warp a leaf; the last to arrive at a node carries on to its parent (Karras 2012).
#pragma once

#include "gpu/best_time.cuh"

namespace hpccd::gpu {

// Boxes of a leaf's features and, in every lane, of the whole leaf; by one warp.
template <bool grown, class T>
__device__ DeviceBox refit_leaf(const LaunchParams<T>& params, u32 leaf) {
  const u32 lane = lane_number();
  const DeviceLeaf l = params.leaves[leaf];
  const Bound top{{INFINITY, INFINITY, INFINITY}, 0}, bottom{{-INFINITY, -INFINITY, -INFINITY}, 0};
  DeviceBox whole{{top, top}, {bottom, bottom}};
  if (lane < l.n_faces()) {
    DeviceBox& face = params.face_boxes[l.first_face + lane];
    const u32 c0 = face.tag_low(), c1 = face.tag_high(), c2 = params.face_corner2[l.first_face + lane];
    DeviceBox b = load_point<grown>(&params.points[c0]);
    include(b, load_point<grown>(&params.points[c1]));
    include(b, load_point<grown>(&params.points[c2]));
    b.tag_low() = c0, b.tag_high() = c1;
    store_box(&face, b);
    include(whole, b);
  }
  if (params.fits_edges && lane < l.n_edges()) {
    DeviceBox& edge = params.edge_boxes[l.first_edge + lane];
    const u32 v0 = edge.tag_low(), v1 = edge.tag_high();
    DeviceBox b = load_point<grown>(&params.points[v0]);
    include(b, load_point<grown>(&params.points[v1]));
    b.tag_low() = v0, b.tag_high() = v1;
    store_box(&edge, b);  // inside its triangle's box
  }
  if (lane < l.n_vertices())  // a lone vertex has no triangle
    include(whole, load_point<grown>(&params.points[params.vertex_of_slot[l.first_vertex + lane]]));
  for (int d = 16; d > 0; d /= 2) {
    DeviceBox other;
    for (int end = 0; end < 2; ++end)
      for (int k = 0; k < 3; ++k) {
        other.low[end].x[k] = __shfl_xor_sync(all_lanes, whole.low[end].x[k], d);
        other.high[end].x[k] = __shfl_xor_sync(all_lanes, whole.high[end].x[k], d);
      }
    include(whole, other);
  }
  whole.tag_low() = 0, whole.tag_high() = leaf;
  if (lane == 0) store_box(&params.leaf_boxes[leaf], whole);
  return whole;
}

template <bool grown, class T>
__global__ void refit_leaves_kernel(LaunchParams<T> params) {
  const u32 leaf = (blockIdx.x * blockDim.x + threadIdx.x) / 32;
  if (leaf < params.n_leaves) refit_leaf<grown>(params, leaf);
}

template <bool grown, class T>
__global__ void refit_kernel(LaunchParams<T> params) {
  const u32 leaf = (blockIdx.x * blockDim.x + threadIdx.x) / 32;
  if (leaf >= params.n_leaves || over(params)) return;
  const DeviceBox whole = refit_leaf<grown>(params, leaf);
  if (lane_number() != 0) return;
  u32 node = params.leaf_nodes[leaf];
  store_box(&params.node_boxes[node], whole);
  while (node != 0) {
    node = params.node_parent[node];
    __threadfence();
    if (atomicAdd(&params.node_arrivals[node], 1u) == 0) return;
    __threadfence();
    params.node_arrivals[node] = 0;
    const DeviceBox& own = params.node_boxes[node];
    const u32 child = own.tag_low(), last = own.tag_high();
    DeviceBox b = load_box_fresh(&params.node_boxes[child]);
    include(b, load_box_fresh(&params.node_boxes[child + 1]));
    b.tag_low() = child, b.tag_high() = last;
    store_box(&params.node_boxes[node], b);
  }
}

// The mean of both ends, times two (motion_box.h), or of the start alone.
__device__ inline float area_of(const DeviceBox& b, bool start_alone) {
  float sum = 0;
  for (int end = 0; end < (start_alone ? 1 : 2); ++end) {
    const float *low = b.low[end].x, *high = b.high[end].x;
    const float x = high[0] - low[0], y = high[1] - low[1], z = high[2] - low[2];
    sum += x * y + y * z + z * x;
  }
  return sum;
}

// Sum of the nodes' areas over the root's (Tree::area). Where boxes reach up to some time, their other end says nothing
// of the tree.
template <class T>
__global__ void area_kernel(LaunchParams<T> params) {
  if (over(params)) return;  // nothing was refitted: none is measured
  double sum = 0;
  for (u32 i = blockIdx.x * blockDim.x + threadIdx.x; i < params.n_nodes; i += gridDim.x * blockDim.x)
    sum += area_of(load_box(&params.node_boxes[i]), params.until_best);
  for (int d = 16; d > 0; d /= 2) sum += __shfl_xor_sync(all_lanes, sum, d);
  const float area = area_of(load_box(&params.node_boxes[0]), params.until_best);
  if (lane_number() == 0 && area > 0) atomicAdd(&params.counters->area, sum / area);
}

}  // namespace hpccd::gpu
