// SPDX-License-Identifier: Apache-2.0
// Shared memory of a warp for the features of two leaves and the candidates among them.
#pragma once

#include "bvh/tree.h"
#include "gpu/feature_pair.cuh"
#include "gpu/launch_params.cuh"

namespace hpccd::gpu {

// A leaf of one world, and the vertex of each lane's corner.
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

// The vertices of the lane's edge or face; the third is unused for an edge. All lanes must call.
__device__ __forceinline__ VertexNumbers vertices_of_corners(const LeafCorners& l, u32 corners) {
  return {{__shfl_sync(all_lanes, l.corner, corners & 31), __shfl_sync(all_lanes, l.corner, corners >> 8 & 31),
           __shfl_sync(all_lanes, l.corner, corners >> 16 & 31)}};
}

// The box of the feature, with the first two vertices as tags.
template <class T>
__device__ __forceinline__ DeviceBox feature_box(const LaunchParams<T>& params, const VertexNumbers& v, bool is_face) {
  DeviceBox b = load_point<true>(&params.points[v[0]]);
  include(b, load_point<true>(&params.points[v[1]]));
  if (is_face) include(b, load_point<true>(&params.points[v[2]]));
  b.tag_low() = v[0], b.tag_high() = v[1];
  return b;
}

inline constexpr u32 candidate_warps = 4;
static_assert(3 * Tree::leaf_size <= 32, "a lane for each feature of a leaf");

// Candidates that wait for the filter, and those that have passed it.
struct CandidateQueue {
  uint4 vertices[64];  // the vertices where p, a and b begin and end (span_ends); unused for snapshots
  uint2 features[64];
  uint2 survivors[2][96];
};

struct CandidateSpace : CandidateQueue {
  // Features of the two leaves that overlap the other leaf, and their numbers in their world. The four words of a box
  // are stored separately, so that neighbouring lanes read neighbouring words.
  Bound bound[2][4][3 * Tree::leaf_size];
  u32 number[2][3 * Tree::leaf_size];
  u32 corner2[Tree::leaf_size];

  __device__ void put(u32 side, u32 at, const DeviceBox& b) {
    for (int end = 0; end < 2; ++end)
      store(&bound[side][end][at], b.low[end]), store(&bound[side][2 + end][at], b.high[end]);
  }
  __device__ DeviceBox box(u32 side, u32 at) const {
    const auto word = [&](int i) { return bound_of(*reinterpret_cast<const float4*>(&bound[side][i][at])); };
    return {{word(0), word(1)}, {word(2), word(3)}};
  }
};

// Appends the edges of a leaf that overlap the leaf `other` to list `side`.
template <Query query, class T>
__device__ u32 stage_edges(const LaunchParams<T>& params, const LeafCorners& l, u32 other, CandidateSpace& s,
                           u32 side) {
  const u32 lane = lane_number();
  bool near = lane < l.leaf.n_edges();
  const LeafFeature edge = near ? load_feature(params.leaf_edges, l.leaf.first_edge + lane) : LeafFeature{0, 0};
  const VertexNumbers v = vertices_of_corners(l, edge.corners);
  DeviceBox b;
  if (near) {
    b = feature_box(params, v, false);
    near = overlap<query>(b, load_box(&params.leaf_boxes[other]));
  }
  const u32 mask = __ballot_sync(all_lanes, near), at = __popc(mask & ((1u << lane) - 1));
  if (near) {
    s.put(side, at, b);
    s.number[side][at] = edge.number;
  }
  return __popc(mask);
}

template <Query query, class T>
__device__ u32 stage_vertices(const LaunchParams<T>& params, const LeafCorners& l, u32 other, CandidateSpace& s) {
  const u32 lane = lane_number();
  DeviceBox b;
  bool near = lane < l.leaf.n_vertices();
  if (near) {
    b = load_point<grows_boxes(query)>(&params.points[l.corner]);
    near = overlap<query>(b, load_box(&params.leaf_boxes[other]));
  }
  const u32 mask = __ballot_sync(all_lanes, near), at = __popc(mask & ((1u << lane) - 1));
  if (near) {
    b.tag_low() = l.corner;
    s.put(0, at, b);
  }
  return __popc(mask);
}

template <Query query, class T>
__device__ u32 stage_faces(const LaunchParams<T>& params, const LeafCorners& l, u32 other, CandidateSpace& s) {
  const u32 lane = lane_number();
  bool near = lane < l.leaf.n_faces();
  const LeafFeature face = near ? load_feature(params.leaf_faces, l.leaf.first_face + lane) : LeafFeature{0, 0};
  const VertexNumbers v = vertices_of_corners(l, face.corners);
  DeviceBox b;
  if (near) {
    b = feature_box(params, v, true);
    near = overlap<query>(b, load_box(&params.leaf_boxes[other]));
  }
  const u32 mask = __ballot_sync(all_lanes, near), at = __popc(mask & ((1u << lane) - 1));
  if (near) {
    s.put(1, at, b);
    s.corner2[at] = v[2];
    s.number[1][at] = face.number;
  }
  return __popc(mask);
}

}  // namespace hpccd::gpu
