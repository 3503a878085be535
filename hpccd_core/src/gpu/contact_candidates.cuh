// SPDX-License-Identifier: Apache-2.0
// candidates.cuh for contacts only, with all features of two leaves at once (H200, single precision: cloth-ball 0.30
// to 0.23 ms, n-body 0.35 to 0.28).
#pragma once

#include "gpu/candidates.cuh"
#include "gpu/leaf_kdops.cuh"
#include "gpu/leaf_pairs_ahead.cuh"
#include "gpu/staged_leaves.cuh"

namespace hpccd::gpu {

// Pairs of one kind between two lists of staged features: the start of the second list, and the lengths of both.
struct StagedPairs {
  u32 second, n_first, n_second;
  __device__ u32 count() const { return n_first * n_second; }
};

// For i < 576 and n <= 24: exact, as (i + 1/2) / n is never nearer than 1 / 48 to an integer.
__device__ inline u32 quotient(u32 i, u32 n) {
  return static_cast<u32>((static_cast<float>(i) + 0.5f) * __frcp_rn(static_cast<float>(n)));
}

// side: of the first features, if these are vertices. first_edge: number of the first edge of the world. same: a leaf
// paired with itself, where each pair of edges occurs twice.
__device__ __forceinline__ LanePair staged_pair(const StagedLeaves& s, const StagedPairs& of, u32 side, u32 first_edge,
                                                u32 c, bool edges, bool same) {
  const u32 i = quotient(c, of.n_second), j = c - i * of.n_second;
  LanePair pair{!edges || !same || i < j, {0, 0, 0, 0}, {0, 0}};
  if (!pair.wanted) return pair;
  const u32 y = of.second + j;
  const DeviceBox a = edges ? s.edge_box(i) : s.vertex_box(side, i), b = s.second_box(y);
  const u32 a0 = a.tag_low(), a1 = a.tag_high(), b0 = b.tag_low(), b1 = b.tag_high();
  const u32 b2 = edges ? b1 : s.corner2[y - StagedLeaves::most_edges];
  pair.wanted = overlap<Query::contacts>(a, b) && a0 != b0 && a0 != b1 && a0 != b2 && a1 != b0 && a1 != b1;
  const u32 number = s.second_number[y];
  if (edges) {
    const u32 own = s.first_number[i];
    const bool ordered = own < number;
    pair.vertices = ordered ? span_ends<Kind::edge_edge>(a0, a1, b0, b1) : span_ends<Kind::edge_edge>(b0, b1, a0, a1);
    pair.features = {first_edge + (ordered ? own : number), (ordered ? number : own) | kind_bit};
  } else {
    pair.vertices = span_ends<Kind::vertex_face>(a0, b0, b1, b2);
    pair.features = {a0, number};
  }
  return pair;
}

// A pair of leaves, the first numbered through all worlds, and both as numbered in the tree.
struct LeavesOfPair {
  uint2 numbers;
  DeviceLeaf first, second;
};

template <class Policy, bool filtered, class T>
__device__ __forceinline__ void contact_candidates(const LaunchParams<T>& params, StagedLeaves& s,
                                                   CandidateState& state, const LeavesOfPair& leaves) {
  const u32 world = world_of_leaves(params, leaves.numbers);
  const u32 x = leaves.numbers.x, y = world * params.n_leaves + leaves.numbers.y;
  const bool same = x == y;
  FetchedLeaf a = begin_leaf(params, leaves.first, world), b = begin_leaf(params, leaves.second, world);
  const u32 tested = tested_features(params, leaves.first, leaves.second);
  fetch_corners(params, a);
  fetch_corners(params, b);
  stage_corners(s, a, 0);
  stage_corners(s, b, 1);
  __syncwarp();
  StagedCounts n;
  stage_features<0>(s, a, load_box(&params.leaf_boxes[y]), tested, n);
  stage_features<1>(s, b, load_box(&params.leaf_boxes[x]), tested, n);
  __syncwarp();
  const StagedPairs edge_edge{0, n.edges[0], n.edges[1]};
  const StagedPairs vertex_face[2] = {{StagedLeaves::faces_at(1), n.vertices[0], n.faces[1]},
                                      {StagedLeaves::faces_at(0), n.vertices[1], same ? 0 : n.faces[0]}};
  const u32 n_edges = edge_edge.count(), until_other = n_edges + vertex_face[0].count(),
            total = until_other + vertex_face[1].count();
  bool drops = false;
  if constexpr (filtered) drops = are_filtered(params, leaves.first, leaves.second);
#pragma unroll 1
  for (u32 base = 0; base < total; base += 32) {
    const u32 c = base + lane_number();
    const bool edges = c < n_edges, other = c >= until_other;
    const StagedPairs of = edges ? edge_edge : other ? vertex_face[1] : vertex_face[0];
    const u32 begin = edges ? 0 : other ? until_other : n_edges;
    LanePair pushed{false, {0, 0, 0, 0}, {0, 0}};
    if (c < total) pushed = staged_pair(s, of, other, world * params.n_edges, c - begin, edges, same);
    if constexpr (filtered)
      if (drops) drop_ignored<Query::contacts>(params, state, pushed, world);
    const u32 mask = __ballot_sync(all_lanes, pushed.wanted);
    if (pushed.wanted) {
      const u32 at = state.n + __popc(mask & ((1u << lane_number()) - 1));
      s.vertices[at] = pushed.vertices;
      s.features[at] = pushed.features;
    }
    state.n += __popc(mask);
    if (state.n >= 32) filter_candidates<Query::contacts, Policy>(params, s, state);
  }
  __syncwarp();
}

// In a fast frame, whether this kernel computes the pair: floats suffice for some worlds only.
template <class Policy, class T>
__device__ bool is_for(const LaunchParams<T>& params, u32 world) {
  return !params.fast || (params.worlds[world].floats_suffice != 0) == std::is_same_v<Policy, Likely>;
}

template <class Policy, bool filtered, class T>
__global__ __launch_bounds__(32 * candidate_warps,
                             6) void contact_candidates_kernel(const __grid_constant__ LaunchParams<T> params) {
  __shared__ StagedLeaves spaces[candidate_warps];
  StagedLeaves& s = spaces[threadIdx.x / 32];
  CandidateState state;
  for_leaf_pairs(params, [&](u64 begin, u64 end) {
    const LeafPairsAhead ahead(params, begin, end);
    u32 near = (1u << (end - begin)) - 1;
    for (u32 k = 0; k < LeafPairsAhead::most; ++k) {
      const uint2 leaves = ahead.pair(k);
      const u32 world = world_of_leaves(params, leaves);
      if (leaf_kdops_apart(params, {leaves.x, world * params.n_leaves + leaves.y}) || !is_for<Policy>(params, world))
        near &= ~(1u << k);
    }
#pragma unroll 1
    for (; near; near &= near - 1) {
      const u32 k = __ffs(near) - 1;
      contact_candidates<Policy, filtered>(params, s, state, {ahead.pair(k), ahead.first(k), ahead.second(k)});
    }
  });
  finish_candidates<Query::contacts, Policy, filtered>(params, s, state);
}

}  // namespace hpccd::gpu
