// SPDX-License-Identifier: Apache-2.0
// Features of one leaf in one world: their vertices and boxes, from the places of its corners. A warp at one leaf.
#pragma once

#include "gpu/launch_params.cuh"

namespace hpccd::gpu {

// A leaf, and the vertex of the lane's corner.
struct LeafCorners {
  DeviceLeaf leaf;
  u32 corner;
};

template <class T>
__device__ __forceinline__ LeafCorners leaf_corners(const LaunchParams<T>& params, u32 leaf, u32 world) {
  LeafCorners l{params.leaves[leaf], 0};
  if (lane_number() < l.leaf.n_corners())
    l.corner = world * params.n_vertices + __ldg(params.corners + l.leaf.first_corner + lane_number());
  return l;
}

__device__ __forceinline__ LeafFeature load_feature(const LeafFeature* features, u32 at) {
  const uint2 f = __ldg(reinterpret_cast<const uint2*>(features) + at);
  return {f.x, f.y};
}

// The vertices of the lane's edge or face; the third of an edge is no matter. All lanes must call.
__device__ __forceinline__ VertexNumbers vertices_of_corners(const LeafCorners& l, u32 corners) {
  return {{__shfl_sync(all_lanes, l.corner, corners & 31), __shfl_sync(all_lanes, l.corner, corners >> 8 & 31),
           __shfl_sync(all_lanes, l.corner, corners >> 16 & 31)}};
}

// Its box, with the first two vertices as tags.
template <class T>
__device__ __forceinline__ DeviceBox feature_box(const LaunchParams<T>& params, const VertexNumbers& v, bool is_face) {
  DeviceBox b = load_point<true>(&params.points[v[0]]);
  include(b, load_point<true>(&params.points[v[1]]));
  if (is_face) include(b, load_point<true>(&params.points[v[2]]));
  b.tag_low() = v[0], b.tag_high() = v[1];
  return b;
}

}  // namespace hpccd::gpu
