// SPDX-License-Identifier: Apache-2.0
// A first bound where the nearest pair of the last call gives a poor one, as after a jump: one warp for each pair of
// meshes descends to near leaves and keeps, of each level, the eight pairs of nodes with the nearest centres. (By the
// farthest points of boxes, the descent missed near places of bumpy spheres.) Two spheres of 720,000 triangles that
// jump: 24,000 to 73,000 pairs of leaves without it, 3,000 to 15,000 with it.
#pragma once

#include "gpu/nearest_leaves.cuh"

namespace hpccd::gpu {

inline constexpr u32 descent_kept = 8, descent_leaves = 3;

__device__ inline float square_of_centers(const DeviceBox& a, const DeviceBox& b) {
  float s = 0;
  for (int k = 0; k < 3; ++k) {
    const float d = (a.low[0].x[k] - b.low[0].x[k]) + (a.high[0].x[k] - b.high[0].x[k]);  // twice that of the centres
    s += d * d;
  }
  return s;
}

template <class T>
__global__ __launch_bounds__(128) void nearest_descent_kernel(const __grid_constant__ LaunchParams<T> params,
                                                              const __grid_constant__ NearestTask task) {
  const u32 of = (blockIdx.x * blockDim.x + threadIdx.x) / 32, lane = lane_number();
  if (of >= task.n_all) return;
  const u32 world = of / task.n_pairs;
  const SearchedMeshes meshes = task.meshes[of - world * task.n_pairs];
  NearestSoFar& s = task.so_far[of];
  if (!meshes.bounded || meshes.root_a == no_node || meshes.root_b == no_node || s.intersecting != no_pair) return;
  // The results are still those of the last call.
  if (s.key != no_pair && double_of(s.distance) <= 1.05 * task.results[of].distance) return;
  u32 a = meshes.root_a, b = meshes.root_b, n = 1;  // of the first n lanes
#pragma unroll 1
  for (;;) {
    const u32 from = lane / 4, right_a = lane & 1, right_b = lane >> 1 & 1;
    const u32 parent_a = __shfl_sync(all_lanes, a, from), parent_b = __shfl_sync(all_lanes, b, from);
    uint2 link_a{0, 0}, link_b{0, 0};
    if (from < n) link_a = params.node_links[parent_a], link_b = params.node_links[parent_b];
    if (!__ballot_sync(all_lanes, link_a.x || link_b.x)) break;
    const u32 child_a = link_a.x ? link_a.x + right_a : parent_a, child_b = link_b.x ? link_b.x + right_b : parent_b;
    float apart = INFINITY;
    if (from < n && (link_a.x || !right_a) && (link_b.x || !right_b) &&
        NodeContent::tested(task.contents[child_a].kinds, task.contents[child_b].kinds))
      apart = square_of_centers(box_of_node(params, world, child_a), box_of_node(params, world, child_b));
    u32 rank = 0;
#pragma unroll 1
    for (u32 i = 0; i < 32; ++i) {
      const float other = __shfl_sync(all_lanes, apart, i);
      rank += other < apart || (other == apart && i < lane);
    }
    const bool kept = apart < INFINITY && rank < descent_kept;
    n = __popc(__ballot_sync(all_lanes, kept));
    if (n == 0) return;
    u32 source = 0;
#pragma unroll 1
    for (u32 i = 0; i < n; ++i) {
      const u32 mask = __ballot_sync(all_lanes, kept && rank == i);
      if (lane == i) source = __ffs(mask) - 1;
    }
    a = __shfl_sync(all_lanes, child_a, source), b = __shfl_sync(all_lanes, child_b, source);
  }
  float least = INFINITY;
#pragma unroll 1
  for (u32 i = 0; i < min(n, descent_leaves); ++i) {
    const u32 leaf_a = params.node_links[__shfl_sync(all_lanes, a, i)].y,
              leaf_b = params.node_links[__shfl_sync(all_lanes, b, i)].y;
    if ((task.leaf_contents[leaf_a].kinds | task.leaf_contents[leaf_b].kinds) & NodeContent::isolated_vertices)
      continue;
    least = fminf(least, square_of_corners(SearchedLeaf(params, leaf_a, world), SearchedLeaf(params, leaf_b, world)));
  }
  if (lane == 0 && least < INFINITY) lower_limit_by_box(s, meshes.most_lack, least);
}

}  // namespace hpccd::gpu
