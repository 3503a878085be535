// SPDX-License-Identifier: Apache-2.0
// All features of two leaves that may touch one of the other leaf, side by side in shared memory: loads of different
// kinds wait for memory together, and pairs of different kinds fill a warp together.
#pragma once

#include "gpu/candidate_space.cuh"

namespace hpccd::gpu {

struct StagedLeaves : CandidateQueue {
  static constexpr u32 most_edges = 3 * Tree::leaf_size, most_vertices = most_edges, most_faces = Tree::leaf_size;
  static_assert(most_edges + most_faces == 32, "a lane for each edge and each face of a leaf");
  // The first features of pairs: edges of the first leaf, its vertices, and those of the second leaf, whose boxes have
  // no extent. The second features: edges of the second leaf, its faces, and those of the first.
  __device__ static constexpr u32 vertices_at(u32 side) { return most_edges + (side ? most_vertices : 0); }
  __device__ static constexpr u32 faces_at(u32 side) { return most_edges + (side ? 0 : most_faces); }
  // The four words of a box lie apart, so that neighbouring lanes read neighbouring words.
  static constexpr u32 n_first = most_edges + 2 * most_vertices, n_second = most_edges + 2 * most_faces;
  Bound first_low[2][n_first], first_high[2][most_edges], second[4][n_second];
  u32 first_number[most_edges], second_number[n_second], corner2[2 * most_faces];

  __device__ void put_edge(u32 at, const DeviceBox& b) {
    put_vertex(at, b);
    for (int end = 0; end < 2; ++end) store(&first_high[end][at], b.high[end]);
  }
  __device__ void put_vertex(u32 at, const DeviceBox& b) {
    for (int end = 0; end < 2; ++end) store(&first_low[end][at], b.low[end]);
  }
  __device__ void put_second(u32 at, const DeviceBox& b) {
    for (int end = 0; end < 2; ++end) store(&second[end][at], b.low[end]), store(&second[2 + end][at], b.high[end]);
  }
  __device__ static Bound load(const Bound& b) { return bound_of(*reinterpret_cast<const float4*>(&b)); }
  __device__ DeviceBox first_box(u32 at, bool edge) const {
    const Bound* high = edge ? first_high[0] + at : first_low[0] + at;
    return {{load(first_low[0][at]), load(first_low[1][at])}, {load(high[0]), load(high[edge ? most_edges : n_first])}};
  }
  __device__ DeviceBox second_box(u32 at) const {
    return {{load(second[0][at]), load(second[1][at])}, {load(second[2][at]), load(second[3][at])}};
  }
};

// How many features of each leaf were staged.
struct StagedCounts {
  u32 edges[2], faces[2], vertices[2];
};

// Edges and faces of one of the two leaves that overlap the other.
template <u32 side, class T>
__device__ __forceinline__ void stage_edges_and_faces(const LaunchParams<T>& params, StagedLeaves& s,
                                                      const LeafCorners& l, u32 other, u32 tested, StagedCounts& n) {
  constexpr u32 most = StagedLeaves::most_edges, edge_lanes = (1u << most) - 1;
  const u32 lane = lane_number();
  const bool is_edge = lane < most;
  bool near = is_edge ? (tested & tests_edge_edge) && lane < l.leaf.n_edges()
                      : (tested & tests_vertex_face) && lane - most < l.leaf.n_faces();
  LeafFeature feature{0, 0};
  if (near)
    feature = is_edge ? load_feature(params.leaf_edges, l.leaf.first_edge + lane)
                      : load_feature(params.leaf_faces, l.leaf.first_face + lane - most);
  const VertexNumbers v = vertices_of_corners(l, feature.corners);
  DeviceBox b;
  if (near) {
    b = feature_box(params, v, !is_edge);
    near = overlap<Query::contacts>(b, load_box(&params.leaf_boxes[other]));
  }
  const u32 mask = __ballot_sync(all_lanes, near), below = mask & ((1u << lane) - 1);
  n.edges[side] = __popc(mask & edge_lanes), n.faces[side] = __popc(mask & ~edge_lanes);
  if (!near) return;
  const u32 at = is_edge ? __popc(below) : StagedLeaves::faces_at(side) + __popc(below & ~edge_lanes);
  if (side == 0 && is_edge) {
    s.put_edge(at, b);
    s.first_number[at] = feature.number;
  } else {
    s.put_second(at, b);
    s.second_number[at] = feature.number;
    if (!is_edge) s.corner2[at - most] = v[2];
  }
}

// Vertices of one of them, its first corners.
template <u32 side, class T>
__device__ __forceinline__ void stage_vertices_of(const LaunchParams<T>& params, StagedLeaves& s, const LeafCorners& l,
                                                  u32 other, u32 tested, StagedCounts& n) {
  bool near = (tested & tests_vertex_face) && lane_number() < l.leaf.n_vertices();
  DeviceBox box;
  if (near) {
    box = load_point<false>(&params.points[l.corner]);
    near = overlap<Query::contacts>(box, load_box(&params.leaf_boxes[other]));
  }
  const u32 mask = __ballot_sync(all_lanes, near);
  n.vertices[side] = __popc(mask);
  if (!near) return;
  box.tag_low() = l.corner;
  s.put_vertex(StagedLeaves::vertices_at(side) + __popc(mask & ((1u << lane_number()) - 1)), box);
}

}  // namespace hpccd::gpu
