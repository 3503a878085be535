// SPDX-License-Identifier: Apache-2.0
// Pairs of leaves whose boxes overlap: one warp a leaf goes down the tree, 32 nodes at a time, depth first. It looks
// only at leaves of its world from its own number on, so that each pair comes once. The pairs are the CPU's: a pair of
// leaves that overlap is reached whatever the way down.
#pragma once

#include "gpu/best_time.cuh"

namespace hpccd::gpu {

inline constexpr u32 traverse_warps = 4;
// A batch of 32 nodes puts at most 32 more on the stack than it takes off, and lies a level deeper: 32 * (depth + 1).
inline constexpr u32 traverse_depth = 40;
inline constexpr u32 traverse_stack = 32 * (traverse_depth + 2);
inline constexpr u32 traverse_found = 128;

template <class T>
__device__ bool meshes_enabled(const LaunchParams<T>& params, u32 mesh_a, u32 mesh_b) {
  if (mesh_a == no_mesh || mesh_b == no_mesh) return true;
  return params.enabled[mesh_a * params.n_meshes + mesh_b];
}

template <bool snapshot, class T>
__global__ __launch_bounds__(32 * traverse_warps) void traverse_kernel(LaunchParams<T> params) {
  __shared__ u32 stacks[traverse_warps][traverse_stack];
  __shared__ u32 founds[traverse_warps][traverse_found];
  const u32 lane = lane_number(), warp = threadIdx.x / 32, below = (1u << lane) - 1;
  const u32 leaf = blockIdx.x * traverse_warps + warp;
  if (leaf >= params.all_leaves() || over(params)) return;
  const u32 world = params.by_leaves(leaf), own = leaf - world * params.n_leaves;
  const DeviceBox* boxes = params.node_boxes + static_cast<u64>(world) * params.n_nodes;
  u32* stack = stacks[warp];
  u32* found = founds[warp];
  u32 n_stack = 0, n_found = 0;
  u64 tests = 0;
  const DeviceBox box = load_box(&params.leaf_boxes[leaf]);
  const u32 mesh = params.enabled ? params.node_mesh[params.leaf_nodes[own]] : no_mesh;

  const auto flush = [&] {
    __syncwarp();
    u64 base = 0;
    if (lane == 0) base = atomicAdd(&params.counters->leaf_pairs, static_cast<u64>(n_found));
    base = __shfl_sync(all_lanes, base, 0);
    for (u32 i = lane; i < n_found; i += 32)
      if (base + i < params.leaf_pairs.capacity) params.leaf_pairs.pairs[base + i] = {leaf, found[i]};
    __syncwarp();
    n_found = 0;
  };
  // Keeps a node of the lane: leaves go to the list, others on the stack.
  const auto keep = [&](bool wanted, u32 node, const DeviceBox& b) {
    const bool hit = wanted && b.tag_high() >= own && overlap<snapshot ? Query::proximity : Query::contacts>(box, b) &&
                     (!params.enabled || meshes_enabled(params, mesh, params.node_mesh[node]));
    const u32 leaves = __ballot_sync(all_lanes, hit && b.tag_low() == 0),
              inner = __ballot_sync(all_lanes, hit && b.tag_low() != 0);
    if (hit && b.tag_low() == 0) found[n_found + __popc(leaves & below)] = b.tag_high();
    if (hit && b.tag_low() != 0) stack[n_stack + __popc(inner & below)] = b.tag_low();
    n_found += __popc(leaves);
    n_stack += __popc(inner);
    if (n_found > traverse_found - 32) flush();
  };

  keep(lane == 0, 0, load_box(&boxes[0]));
  while (n_stack > 0) {
    __syncwarp();
    const u32 n = n_stack < 32 ? n_stack : 32;
    const bool active = lane < n;
    const u32 child = active ? stack[n_stack - 1 - lane] : 0;
    __syncwarp();
    n_stack -= n;
    tests += 2 * n;
    const DeviceBox left = load_box(&boxes[child]), right = load_box(&boxes[active ? child + 1 : 0]);
    keep(active, child, left);
    keep(active, child + 1, right);
  }
  if (n_found > 0) flush();
  if (lane == 0) atomicAdd(&params.counters->node_tests, tests);
}

}  // namespace hpccd::gpu
