// SPDX-License-Identifier: Apache-2.0
// All features of two leaves that may touch a feature of the other leaf, side by side in shared memory. Corners are
// fetched once and all together, and pairs of different kinds fill a warp together.
#pragma once

#include "gpu/candidate_space.cuh"

namespace hpccd::gpu {

struct StagedLeaves : CandidateQueue {
  static constexpr u32 most_edges = 3 * Tree::leaf_size, most_faces = Tree::leaf_size;
  static constexpr u32 most_corners = 3 * Tree::leaf_size;
  static_assert(most_edges + most_faces == 32, "a lane for each edge and each face of a leaf");
  // The second features of pairs: edges of the second leaf, its faces, and those of the first.
  __device__ static constexpr u32 faces_at(u32 side) { return most_edges + (side ? 0 : most_faces); }
  static constexpr u32 n_second = most_edges + 2 * most_faces;
  // Corners of both leaves, at both ends. Tags: the vertex; the amount by which boxes grow at the second end.
  Bound corner[2][2][most_corners];
  // The four words of a box are stored separately, so that neighbouring lanes read neighbouring words: low at both
  // ends, high.
  Bound edge[4][most_edges], second[4][n_second];
  u32 first_number[most_edges], second_number[n_second], corner2[2 * most_faces];
  u32 vertex[2][most_corners];  // which corners

  __device__ static Bound load(const Bound& b) { return bound_of(*reinterpret_cast<const float4*>(&b)); }
  __device__ DeviceBox edge_box(u32 at) const {
    return {{load(edge[0][at]), load(edge[1][at])}, {load(edge[2][at]), load(edge[3][at])}};
  }
  __device__ DeviceBox vertex_box(u32 side, u32 at) const {
    const u32 c = vertex[side][at];
    const Bound t0 = load(corner[side][0][c]), t1 = load(corner[side][1][c]);
    return {{t0, t1}, {t0, t1}};
  }
  __device__ DeviceBox second_box(u32 at) const {
    return {{load(second[0][at]), load(second[1][at])}, {load(second[2][at]), load(second[3][at])}};
  }
  // The box of a corner that is part of a feature.
  __device__ DeviceBox grown_corner(u32 side, u32 c) const {
    const Bound t0 = load(corner[side][0][c]), t1 = load(corner[side][1][c]);
    DeviceBox b{{t0, t1}, {t0, t1}};
    const float reach = __uint_as_float(t1.tag);
    for (int k = 0; k < 3; ++k) b.low[1].x[k] -= reach, b.high[1].x[k] += reach;
    return b;
  }
};

// The number of staged features of each leaf.
struct StagedCounts {
  u32 edges[2], faces[2], vertices[2];
};

// A leaf, the vertex of the lane's corner, its position, and the lane's edge or face.
struct FetchedLeaf {
  DeviceLeaf leaf;
  u32 corner;
  Bound t0, t1;
  LeafFeature feature;
};

// Data that depends only on the leaf.
template <class T>
__device__ __forceinline__ FetchedLeaf begin_leaf(const LaunchParams<T>& params, const DeviceLeaf& leaf, u32 world) {
  constexpr u32 most = StagedLeaves::most_edges;
  const u32 lane = lane_number();
  FetchedLeaf l{leaf, 0, {}, {}, {0, 0}};
  if (lane < leaf.n_corners()) l.corner = world * params.n_vertices + __ldg(params.corners + leaf.first_corner + lane);
  if (lane < most) {
    if (lane < leaf.n_edges()) l.feature = load_feature(params.leaf_edges, leaf.first_edge + lane);
  } else if (lane - most < leaf.n_faces()) {
    l.feature = load_feature(params.leaf_faces, leaf.first_face + lane - most);
  }
  return l;
}

template <class T>
__device__ __forceinline__ void fetch_corners(const LaunchParams<T>& params, FetchedLeaf& l) {
  if (lane_number() >= l.leaf.n_corners()) return;
  const float4* at = reinterpret_cast<const float4*>(params.points + l.corner);
  l.t0 = bound_of(__ldg(at)), l.t1 = bound_of(__ldg(at + 1));
}

__device__ __forceinline__ void stage_corners(StagedLeaves& s, const FetchedLeaf& l, u32 side) {
  const u32 lane = lane_number();
  if (lane >= l.leaf.n_corners()) return;
  Bound t0 = l.t0;
  t0.tag = l.corner;
  store(&s.corner[side][0][lane], t0);
  store(&s.corner[side][1][lane], l.t1);
}

// Stages the edges and faces of one of the two leaves that overlap the other; the corners are staged already.
template <u32 side>
__device__ __forceinline__ void stage_edges_and_faces(StagedLeaves& s, const FetchedLeaf& l, const DeviceBox& other,
                                                      u32 tested, StagedCounts& n) {
  constexpr u32 most = StagedLeaves::most_edges, edge_lanes = (1u << most) - 1;
  const u32 lane = lane_number();
  const bool is_edge = lane < most;
  bool near = is_edge ? (tested & tests_edge_edge) && lane < l.leaf.n_edges()
                      : (tested & tests_vertex_face) && lane - most < l.leaf.n_faces();
  DeviceBox b;
  u32 v2 = 0;
  if (near) {
    const u32 corners = l.feature.corners;
    b = s.grown_corner(side, corners & 0xFF);
    const DeviceBox next = s.grown_corner(side, corners >> 8 & 0xFF);
    include(b, next);
    b.tag_high() = next.tag_low();
    if (!is_edge) {
      const DeviceBox last = s.grown_corner(side, corners >> 16);
      include(b, last);
      v2 = last.tag_low();
    }
    near = overlap<Query::contacts>(b, other);
  }
  const u32 mask = __ballot_sync(all_lanes, near), below = mask & ((1u << lane) - 1);
  n.edges[side] = __popc(mask & edge_lanes), n.faces[side] = __popc(mask & ~edge_lanes);
  if (!near) return;
  const u32 at = is_edge ? __popc(below) : StagedLeaves::faces_at(side) + __popc(below & ~edge_lanes);
  const bool first = side == 0 && is_edge;
  for (int end = 0; end < 2; ++end) {
    store(first ? &s.edge[end][at] : &s.second[end][at], b.low[end]);
    store(first ? &s.edge[2 + end][at] : &s.second[2 + end][at], b.high[end]);
  }
  if (first) {
    s.first_number[at] = l.feature.number;
  } else {
    s.second_number[at] = l.feature.number;
    if (!is_edge) s.corner2[at - most] = v2;
  }
}

// Stages the vertices of one of them, which are its first corners.
template <u32 side>
__device__ __forceinline__ void stage_vertices_of(StagedLeaves& s, const FetchedLeaf& l, const DeviceBox& other,
                                                  u32 tested, StagedCounts& n) {
  bool near = (tested & tests_vertex_face) && lane_number() < l.leaf.n_vertices();
  if (near) {
    const Bound t0 = s.load(s.corner[side][0][lane_number()]), t1 = s.load(s.corner[side][1][lane_number()]);
    near = overlap<Query::contacts>(DeviceBox{{t0, t1}, {t0, t1}}, other);
  }
  const u32 mask = __ballot_sync(all_lanes, near);
  n.vertices[side] = __popc(mask);
  if (near) s.vertex[side][__popc(mask & ((1u << lane_number()) - 1))] = lane_number();
}

template <u32 side>
__device__ __forceinline__ void stage_features(StagedLeaves& s, const FetchedLeaf& l, const DeviceBox& other,
                                               u32 tested, StagedCounts& n) {
  stage_edges_and_faces<side>(s, l, other, tested, n);
  stage_vertices_of<side>(s, l, other, tested, n);
}

}  // namespace hpccd::gpu
