// SPDX-License-Identifier: Apache-2.0
// k-DOPs of leaves: pairs of leaves that are separated along one of their directions are rejected (H200, candidates of
// `fast`: cloth-ball 0.23 to 0.20 ms, n-body 0.28 to 0.19; building the k-DOPs takes 0.01).
#pragma once

#include "gpu/pair_lists.cuh"
#include "gpu/stream.h"

namespace hpccd::gpu {

// One warp per leaf; each half takes every other corner, one lane per direction and end.
template <class T>
__global__ __launch_bounds__(128) void leaf_kdops_kernel(const __grid_constant__ LaunchParams<T> params) {
  constexpr u32 n = 2 * n_kdop_directions;
  static_assert(n == 16);
  const u32 leaf = (blockIdx.x * blockDim.x + threadIdx.x) / 32, lane = lane_number();
  if (leaf >= params.all_leaves()) return;
  const u32 world = params.by_leaves(leaf);
  const DeviceLeaf l = params.leaves[leaf - world * params.n_leaves];
  const u32 n_corners = l.n_corners();
  const u32 corner = lane < n_corners ? world * params.n_vertices + __ldg(params.corners + l.first_corner + lane) : 0;
  float low = INFINITY, high = -INFINITY;
  const auto include = [&](u32 v) {
    const float x = reinterpret_cast<const float*>(params.kdops + v)[lane % n];
    low = x < low ? x : low, high = high < x ? x : high;
  };
  for (u32 i = 0; i < n_corners; i += 2)
    include(__shfl_sync(all_lanes, corner, i + lane / n < n_corners ? i + lane / n : i));
  const float other_low = __shfl_xor_sync(all_lanes, low, n), other_high = __shfl_xor_sync(all_lanes, high, n);
  Kdop& kdop = params.leaf_kdops[leaf];
  if (lane < n)
    kdop.low[lane] = other_low < low ? other_low : low;
  else
    kdop.high[lane - n] = high < other_high ? other_high : high;
}

template <class T>
void launch_leaf_kdops(const LaunchParams<T>& params, cudaStream_t stream) {
  leaf_kdops_kernel<<<blocks_for(std::size_t{params.all_leaves()} * 32, 128), 128, 0, stream>>>(params);
  check_launch("leaf_kdops_kernel");
}

// Both numbered through all worlds. By a whole warp: one half tests whether the first leaf is below, the other whether
// it is above.
template <class T>
__device__ __forceinline__ bool leaf_kdops_apart(const LaunchParams<T>& params, uint2 leaves) {
  constexpr u32 n = 2 * n_kdop_directions;
  const u32 lane = lane_number();
  const Kdop &below = params.leaf_kdops[lane < n ? leaves.x : leaves.y],
             &above = params.leaf_kdops[lane < n ? leaves.y : leaves.x];
  const u32 mask = __ballot_sync(all_lanes, __ldg(below.high + lane % n) < __ldg(above.low + lane % n));
  return mask & mask >> n_kdop_directions & 0x00FF00FFu;  // at both ends
}

}  // namespace hpccd::gpu
