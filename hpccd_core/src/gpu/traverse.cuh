// SPDX-License-Identifier: Apache-2.0
// Traversal: pairs of leaves whose boxes overlap. One warp descends the tree depth first with a few neighbouring
// leaves at once, 32 pairs of leaf and node at a time. (With a single leaf only two of the 32 lanes had a node on the
// published n-body scene, and the traversal took three times as long.) A leaf is paired only with leaves of its world
// whose number is not smaller, so that each pair occurs once. The pairs are those of the CPU: every pair of
// overlapping leaves is reached, whatever the order of the traversal.
#pragma once

#include "gpu/best_time.cuh"

namespace hpccd::gpu {

inline constexpr u32 traverse_warps = 4;
inline constexpr u32 traverse_leaves = 8;
// A number of a node or leaf, and above it the index of the warp's leaf.
inline constexpr u32 traverse_number_bits = 29, most_nodes = 1u << traverse_number_bits;
static_assert(traverse_leaves <= 1u << (32 - traverse_number_bits));
// A batch of 32 nodes pushes at most 32 more nodes than it pops, one level deeper: 32 * (depth + 1).
inline constexpr u32 traverse_depth = 40;
inline constexpr u32 traverse_stack = 32 * (traverse_depth + 2);
inline constexpr u32 traverse_found = 256;

template <class T>
__device__ bool meshes_enabled(const LaunchParams<T>& params, u32 mesh_a, u32 mesh_b) {
  if (mesh_a == no_mesh || mesh_b == no_mesh) return true;
  return params.enabled[mesh_a * params.n_meshes + mesh_b];
}

// The state of one warp.
struct TraverseSpace {
  u32 stack[traverse_stack], found[traverse_found];
  // Its leaves: boxes, whose four words are stored separately, with their number and mesh as tags; the first node of
  // their world.
  Bound bound[4][traverse_leaves];
  u64 first_node[traverse_leaves];

  __device__ void put(u32 slot, const DeviceBox& b) {
    for (int end = 0; end < 2; ++end) store(&bound[end][slot], b.low[end]), store(&bound[2 + end][slot], b.high[end]);
  }
  __device__ DeviceBox box(u32 slot) const {
    const auto word = [&](int i) { return bound_of(*reinterpret_cast<const float4*>(&bound[i][slot])); };
    return {{word(0), word(1)}, {word(2), word(3)}};
  }
};

// Writes the pairs, one leaf after the other, so that readers of the list find pairs of the same leaf together.
template <class T>
__device__ __forceinline__ void flush_leaf_pairs(const LaunchParams<T>& params, const TraverseSpace& s, u32 first_leaf,
                                                 u32 n) {
  __syncwarp();
  const u32 lane = lane_number();
  u64 at = 0;
  if (lane == 0) at = atomicAdd(&params.counters->leaf_pairs, static_cast<u64>(n));
  at = __shfl_sync(all_lanes, at, 0);
#pragma unroll 1
  for (u32 slot = 0; slot < traverse_leaves; ++slot)
#pragma unroll 1
    for (u32 begin = 0; begin < n; begin += 32) {
      const u32 entry = begin + lane < n ? s.found[begin + lane] : 0;
      const bool mine = begin + lane < n && entry >> traverse_number_bits == slot;
      const u32 mask = __ballot_sync(all_lanes, mine);
      const u64 own = at + __popc(mask & ((1u << lane) - 1));
      if (mine && own < params.leaf_pairs.capacity)
        params.leaf_pairs.pairs[own] = {first_leaf + slot, entry & (most_nodes - 1)};
      at += __popc(mask);
    }
  __syncwarp();
}

template <bool snapshot, class T>
__global__ __launch_bounds__(32 * traverse_warps) void traverse_kernel(const __grid_constant__ LaunchParams<T> params) {
  __shared__ TraverseSpace spaces[traverse_warps];
  TraverseSpace& s = spaces[threadIdx.x / 32];
  const u32 lane = lane_number(), below = (1u << lane) - 1;
  const u32 first_leaf = (blockIdx.x * traverse_warps + threadIdx.x / 32) * traverse_leaves;
  if (first_leaf >= params.all_leaves() || over(params)) return;
  const u32 n_leaves = min(traverse_leaves, params.all_leaves() - first_leaf);
  if (lane < n_leaves) {
    const u32 leaf = first_leaf + lane, world = params.by_leaves(leaf), own = leaf - world * params.n_leaves;
    DeviceBox box = load_box(&params.leaf_boxes[leaf]);
    box.tag_low() = own;
    box.tag_high() = params.enabled ? params.node_mesh[params.leaf_nodes[own]] : no_mesh;
    s.put(lane, box);
    s.first_node[lane] = static_cast<u64>(world) * params.n_nodes;
  }
  __syncwarp();
  u32 n_stack = 0, n_found = 0;
  u64 tests = 0;

  // Keeps a node of the lane: leaves go to the list, others on the stack.
  const auto keep = [&](bool wanted, u32 slot, const DeviceBox& box, u32 node, const DeviceBox& b) {
    const bool hit = wanted && b.tag_high() >= box.tag_low() &&
                     overlap<snapshot ? Query::proximity : Query::contacts>(box, b) &&
                     (!params.enabled || meshes_enabled(params, box.tag_high(), params.node_mesh[node]));
    const u32 leaves = __ballot_sync(all_lanes, hit && b.tag_low() == 0),
              inner = __ballot_sync(all_lanes, hit && b.tag_low() != 0);
    const u32 high_bits = slot << traverse_number_bits;
    if (hit && b.tag_low() == 0) s.found[n_found + __popc(leaves & below)] = high_bits | b.tag_high();
    if (hit && b.tag_low() != 0) s.stack[n_stack + __popc(inner & below)] = high_bits | b.tag_low();
    n_found += __popc(leaves);
    n_stack += __popc(inner);
    if (n_found > traverse_found - 32) {
      flush_leaf_pairs(params, s, first_leaf, n_found);
      n_found = 0;
    }
  };

  const u32 root_slot = lane < n_leaves ? lane : 0;
  keep(lane < n_leaves, root_slot, s.box(root_slot), 0, load_box(&params.node_boxes[s.first_node[root_slot]]));
#pragma unroll 1
  while (n_stack > 0) {
    __syncwarp();
    const u32 n = n_stack < 32 ? n_stack : 32;
    const bool active = lane < n;
    const u32 entry = s.stack[n_stack - 1 - (active ? lane : 0)];
    __syncwarp();
    n_stack -= n;
    tests += 2 * n;
    const u32 slot = entry >> traverse_number_bits, child = entry & (most_nodes - 1);
    const DeviceBox box = s.box(slot);
    const DeviceBox* boxes = params.node_boxes + s.first_node[slot] + child;
    const DeviceBox left = load_box(boxes), right = load_box(boxes + 1);
    keep(active, slot, box, child, left);
    keep(active, slot, box, child + 1, right);
  }
  if (n_found > 0) flush_leaf_pairs(params, s, first_leaf, n_found);
  if (lane == 0) atomicAdd(&params.counters->node_tests, tests);
}

}  // namespace hpccd::gpu
