// SPDX-License-Identifier: Apache-2.0
// The search for the nearest features among meshes at poses: its kernels are those of positions, but boxes of nodes and
// positions are computed where they are read. Nothing is refitted.
#pragma once

#include "bvh/kdop.h"
#include "gpu/mesh_at_pose.h"
#include "gpu/nearest_descent.cuh"
#include "gpu/nearest_search.cuh"

namespace hpccd::gpu {

struct AtPoses {};

// In place of vertices, points, and boxes of nodes and leaves. One world.
template <>
struct LaunchParams<AtPoses> : LaunchParams<double> {
  const LocalBox* local_boxes;  // of nodes
  const MeshAtPose* meshes;
  const double* shapes;  // x y z of each vertex in the frame of its mesh
  CoordinateMap map;
  double sums;  // WorldScale
};

template <>
__device__ inline DeviceBox box_of_node<AtPoses>(const LaunchParams<AtPoses>& params, u32, u32 node) {
  const float4* at = reinterpret_cast<const float4*>(params.local_boxes + node);
  const float4 low = __ldg(at), high = __ldg(at + 1);
  const LocalBox box{{low.x, low.y, low.z}, __float_as_uint(low.w), {high.x, high.y, high.z}, 0};
  const BoundsAtPose b = bounds_at(params.meshes + box.mesh, box);
  DeviceBox r;
  for (int end = 0; end < 2; ++end) {
    for (int k = 0; k < 3; ++k) r.low[end].x[k] = b.low[end][k], r.high[end].x[k] = b.high[end][k];
    r.low[end].tag = r.high[end].tag = 0;
  }
  return r;
}

template <>
__device__ inline DeviceBox box_of_leaf<AtPoses>(const LaunchParams<AtPoses>& params, u32 world, u32 leaf) {
  return box_of_node(params, world, __ldg(params.leaf_nodes + leaf));
}

template <>
__device__ inline Vec3<double> position_of<AtPoses>(const LaunchParams<AtPoses>& params, u32, u32 vertex) {
  const double* x = params.shapes + 3 * static_cast<u64>(vertex);
  return params.meshes[__ldg(params.mesh_of_vertex + vertex)].placing({__ldg(x), __ldg(x + 1), __ldg(x + 2)});
}

// With the arithmetic of vertices_kernel.
template <>
__device__ inline DevicePoint bounds_of_corner<AtPoses>(const LaunchParams<AtPoses>& params, u32 vertex) {
  const Vec3<double> x = position_of(params, 0, vertex);
  const SlantedCoordinates slanted(x, params.map);
  return {{{{params.map(x.x, 0), params.map(x.y, 1), params.map(x.z, 2)}, 0},
           {{slanted.along[0], slanted.along[1], slanted.along[2]}, 0}}};
}

template <>
__device__ inline WorldScale scale_of_world<AtPoses>(const LaunchParams<AtPoses>& params, u32) {
  return {params.map.scale, params.sums};
}

template <>
inline void launch_descent<AtPoses>(const LaunchParams<AtPoses>& params, const NearestTask& task,
                                    const Stages& stages) {
  constexpr unsigned threads = 128;
  nearest_descent_kernel<<<blocks_for(std::size_t{task.n_all} * 32, threads), threads, 0, stages.stream>>>(params,
                                                                                                           task);
  check_launch("nearest_descent_kernel");
}

}  // namespace hpccd::gpu
