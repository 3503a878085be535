// SPDX-License-Identifier: Apache-2.0
// Winding numbers of single vertices with respect to closed meshes (solid/containment.h), one warp each.
#pragma once

#include "gpu/nearest_nodes.cuh"
#include "gpu/points.cuh"

namespace hpccd::gpu {

inline constexpr u32 inside_warps = 4;

template <class T>
__global__ __launch_bounds__(32 * inside_warps) void inside_kernel(const __grid_constant__ LaunchParams<T> params,
                                                                   const __grid_constant__ InsideTask task) {
  __shared__ u32 stacks[inside_warps][traverse_stack];
  u32* stack = stacks[threadIdx.x / 32];
  const u32 i = blockIdx.x * inside_warps + threadIdx.x / 32, lane = lane_number(), below = (1u << lane) - 1;
  if (i >= task.n) return;
  const VertexAndMesh asked = task.asked[i];
  const Vec3<double> x = position_of(params, asked.world, asked.vertex);
  const double at[3] = {x.x, x.y, x.z};
  const PointOnDevice point(at, SceneExtent(params.worlds[asked.world]).map());
  const u32 first_vertex = asked.world * params.n_vertices;
  std::int32_t number = 0;
  bool certain = true;
  u32 n_stack = 1;
  if (lane == 0) stack[0] = asked.root;
#pragma unroll 1
  while (n_stack > 0) {
    __syncwarp();
    const u32 n = min(n_stack, 32u);
    const bool active = lane < n;
    const u32 node = stack[n_stack - 1 - (active ? lane : 0)];
    __syncwarp();
    n_stack -= n;
    const DeviceBox box = box_of_node(params, asked.world, node);
    const bool meets = active && meets_ray(point, box), inner = meets && box.tag_low() != 0;
    const u32 mask = __ballot_sync(all_lanes, inner), to = n_stack + 2 * __popc(mask & below);
    if (inner) stack[to] = box.tag_low(), stack[to + 1] = box.tag_low() + 1;
    n_stack += 2 * __popc(mask);
    if (!meets || inner) continue;
    const DeviceLeaf leaf = params.leaves[box.tag_high()];
#pragma unroll 1
    for (u32 k = 0; k < leaf.n_faces(); ++k) {
      const LeafFeature face = params.leaf_faces[leaf.first_face + k];
      Vec3<double> q[3];
      for (u32 j = 0; j < 3; ++j) {
        const u32 corner = params.corners[leaf.first_corner + (face.corners >> 8 * j & 0xFF)];
        const Vec3<T> y = load_start(params.vertices, first_vertex + corner);
        q[j] = {y.x, y.y, y.z};
      }
      certain = add_crossing(point.exact, q, number) && certain;
    }
  }
  for (int d = 16; d > 0; d /= 2) number += __shfl_xor_sync(all_lanes, number, d);
  if (!__all_sync(all_lanes, certain)) number = undecided_winding;
  if (lane == 0) task.numbers[i] = number;
}

}  // namespace hpccd::gpu
