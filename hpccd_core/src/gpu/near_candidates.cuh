// SPDX-License-Identifier: Apache-2.0
// candidates.cuh for proximity only, with all features of two leaves at once; the first leaf of consecutive pairs is
// fetched once (H100: n-body 0.184 to 0.104 ms, 1,024 folded sheets 4.14 to 2.24).
#pragma once

#include "gpu/candidates.cuh"
#include "gpu/leaf_pairs_ahead.cuh"
#include "gpu/near_leaves.cuh"

namespace hpccd::gpu {

// Pairs of one kind between two lists of staged features.
struct NearProduct {
  u32 first, second;  // where the lists begin
  u32 n_pairs, width, magic;

  __device__ static NearProduct of(u32 first, u32 n_first, u32 second, u32 n_second) {
    return {first, second, n_first * n_second, n_second, magic_of(n_second)};
  }
  // i / n for i < 576 and n <= 24 is i magic / 65536 if magic exceeds 65536 / n by less than 2: that adds less than 1 /
  // 48. A quotient with an error of two ulp, at most 1 / 64 n, suffices: the fractional part of 65536 / n is zero or at
  // least 1 / n.
  __device__ static u32 magic_of(u32 n) {
    return static_cast<u32>(__fdividef(65536.0f, static_cast<float>(n ? n : 1))) + 1;
  }
  __device__ uint2 pair(u32 c) const {
    const u32 i = c * magic >> 16;
    return {i, c - i * width};
  }
};

// Each two of n edges once, in rows of equal width: row r of n (or n + 1) numbers combines edge r with all later ones
// and the r-th edge from the end with those after it.
__device__ inline NearProduct edges_of_one_leaf(u32 n) {
  const u32 width = n < 2 ? 1 : (n - 1) | 1;
  return {0, 0, n < 2 ? 0 : width * ((width + 1) / 2), width, NearProduct::magic_of(width)};
}
__device__ inline uint2 two_of_one_leaf(uint2 c, u32 width) {
  return c.y < c.x ? uint2{width - c.x, width - c.y} : uint2{c.x, c.y + 1};
}

// Candidates that wait in shared memory for a place in the lists, and their total number.
struct NearState {
  u32 n = 0, tested[2] = {0, 0};
  u32 ignored[2] = {0, 0};  // by filters, of this lane
};

template <class T>
__device__ __forceinline__ void flush_candidates(const LaunchParams<T>& params, const NearLeaves& s, NearState& state) {
  __syncwarp();
  const u32 lane = lane_number(), below = (1u << lane) - 1;
  const auto waits = [&](u32 at) { return at < state.n; };
  u32 n_edges = 0;
  for (u32 i = 0; i < 96; i += 32)
    n_edges += __popc(__ballot_sync(all_lanes, waits(i + lane) && s.waiting[i + lane].y & kind_bit));
  const u32 n[2] = {state.n - n_edges, n_edges};
  u64 begin = 0;
  if (lane < 2) begin = atomicAdd(&params.counters->survivors[lane], static_cast<u64>(lane ? n[1] : n[0]));
  u64 at[2] = {__shfl_sync(all_lanes, begin, 0), __shfl_sync(all_lanes, begin, 1)};
  for (u32 i = 0; i < 96; i += 32) {
    const uint2 pair = waits(i + lane) ? s.waiting[i + lane] : uint2{0, 0};
#pragma unroll
    for (u32 k = 0; k < 2; ++k) {
      const bool mine = waits(i + lane) && (pair.y & kind_bit) == (k ? kind_bit : 0);
      const u32 mask = __ballot_sync(all_lanes, mine);
      const u64 own = at[k] + __popc(mask & below);
      if (mine && own < params.survivors[k].capacity) params.survivors[k].pairs[own] = {pair.x, pair.y & ~kind_bit};
      at[k] += __popc(mask);
    }
  }
  for (u32 k = 0; k < 2; ++k) state.tested[k] += n[k];
  state.n = 0;
  __syncwarp();
}

// first, second: positions of two features, of different leaves or of one.
__device__ __forceinline__ bool is_near(const NearLeaves& s, u32 first, u32 second, u32 first_edge, bool edges,
                                        bool face_first, uint2& features) {
  const FeatureNumbers a = s.first.numbers_of(first), b = s.second.numbers_of(second);
  const u32 *v = a.vertex, *w = b.vertex;
  // For edges the third vertex repeats the second one; for a vertex all are the same.
  const bool apart = v[0] != w[0] && v[0] != w[1] && v[1] != w[0] && v[1] != w[1] && v[0] != w[2] && v[2] != w[0];
  const bool swapped = edges ? a.number > b.number : face_first;
  features = {(swapped ? b.number : a.number) + (edges ? first_edge : 0),
              (swapped ? a.number : b.number) | (edges ? kind_bit : 0)};
  return apart && overlap(s.first.box(first), s.second.box(second));
}

// drops: some pairs may be ignored or never tested.
template <bool filtered, class T>
__device__ __forceinline__ void keep_near_pairs(const LaunchParams<T>& params, NearLeaves& s, NearState& state,
                                                const NearCounts& a, const NearCounts& b, u32 world, bool same,
                                                bool drops) {
  const u32 first_edge = world * params.n_edges;
  const NearProduct edge_edge = same ? edges_of_one_leaf(a.edges) : NearProduct::of(0, a.edges, 0, b.edges);
  const NearProduct vertex_face = NearProduct::of(a.edges + a.faces, a.vertices, b.edges, b.faces);
  const NearProduct face_vertex = NearProduct::of(a.edges, same ? 0 : a.faces, b.edges + b.faces, b.vertices);
  const u32 until_face = edge_edge.n_pairs + vertex_face.n_pairs, total = until_face + face_vertex.n_pairs;
#pragma unroll 1
  for (u32 base = 0; base < total; base += 32) {
    const u32 c = base + lane_number();
    const bool edges = c < edge_edge.n_pairs, face_first = c >= until_face;
    const NearProduct of = edges ? edge_edge : face_first ? face_vertex : vertex_face;
    uint2 pair = of.pair(c - (edges ? 0 : face_first ? until_face : edge_edge.n_pairs));
    bool near = c < total;
    if (same && edges) {
      pair = two_of_one_leaf(pair, of.width);
      near = near && pair.x < a.edges && pair.y < a.edges;
    }
    uint2 features{0, 0};
    if (near) near = is_near(s, s.near[of.first + pair.x], of.second + pair.y, first_edge, edges, face_first, features);
    if constexpr (filtered) {
      const uint2 numbers{features.x, features.y & ~kind_bit};
      if (drops && near) near = !is_never_tested<false>(params, numbers, edges, world);
      if (drops && near && is_ignored<false>(params, numbers, edges, world)) {
        near = false;
        ++(edges ? state.ignored[1] : state.ignored[0]);
      }
    }
    const u32 mask = __ballot_sync(all_lanes, near);
    if (near) s.waiting[state.n + __popc(mask & ((1u << lane_number()) - 1))] = features;
    state.n += __popc(mask);
    if (state.n >= 64) flush_candidates(params, s, state);
  }
}

// The first leaf of the current pairs, which is staged. Numbered through all worlds.
struct FirstLeaf {
  u32 number = 0xFFFFFFFFu, world = 0;
  DeviceLeaf leaf{};
};

template <class T>
__device__ __forceinline__ void stage_first(const LaunchParams<T>& params, NearLeaves& s, const FirstLeaf& first) {
  const SnapshotReach reach =
      stage_corners(params, s.corners, first.leaf, lane_corner(params, first.leaf, first.world));
  const LeafOrder order(first.leaf);
#pragma unroll 1
  for (u32 i = lane_number(); i < order.n; i += 32) {
    SnapshotBox box;
    FeatureNumbers numbers;
    s.corners.bounds_of(feature_at(params, first.leaf, i), order.is_vertex(i), reach, box, numbers);
    s.first.put(i, box, numbers);
  }
  __syncwarp();
}

// The features of the first leaf that overlap the other leaf.
template <class T>
__device__ __forceinline__ NearCounts near_of_first(const LaunchParams<T>& params, NearLeaves& s,
                                                    const DeviceLeaf& first, u32 other, u32 tested) {
  const LeafOrder order(first);
  const SnapshotBox whole = load_snapshot_box(&params.leaf_boxes[other]);
  NearCounts n;
#pragma unroll 1
  for (u32 base = 0; base < order.n; base += 32) {
    const u32 i = base + lane_number();
    const bool near = i < order.n && (tested & (order.is_edge(i) ? tests_edge_edge : tests_vertex_face)) &&
                      overlap(s.first.box(i), whole);
    const u32 at = n.add(order, i, near);
    if (near) s.near[at] = static_cast<unsigned char>(i);
  }
  return n;
}

// second: numbered in its world.
template <bool filtered, class T>
__device__ __forceinline__ void near_candidates(const LaunchParams<T>& params, NearLeaves& s, NearState& state,
                                                const FirstLeaf& first, u32 second, const DeviceLeaf& second_leaf) {
  const u32 y = first.world * params.n_leaves + second, tested = tested_features(params, first.leaf, second_leaf);
  const LeafOrder order(second_leaf);
  // Loaded before it is known whether they are needed, so that this wait coincides with that for the other leaf's box.
  const u32 corner = lane_corner(params, second_leaf, first.world);
  LeafFeature feature{0, 0};
  if (lane_number() < order.n) feature = feature_at(params, second_leaf, lane_number());
  const NearCounts a = near_of_first(params, s, first.leaf, y, tested);
  if (a.all() == 0) return;
  const SnapshotReach reach = stage_corners(params, s.corners, second_leaf, corner);
  const SnapshotBox whole = load_snapshot_box(&params.leaf_boxes[first.number]);
  NearCounts b;
#pragma unroll 1
  for (u32 base = 0; base < order.n; base += 32) {
    const u32 i = base + lane_number();
    if (base > 0 && i < order.n) feature = feature_at(params, second_leaf, i);
    SnapshotBox box;
    FeatureNumbers numbers;
    s.corners.bounds_of(feature, order.is_vertex(i), reach, box, numbers);
    const bool near = i < order.n && overlap(box, whole);
    const u32 at = b.add(order, i, near);
    if (near) s.second.put(at, box, numbers);
  }
  __syncwarp();
  bool drops = false;
  if constexpr (filtered) drops = are_filtered(params, first.leaf, second_leaf);
  keep_near_pairs<filtered>(params, s, state, a, b, first.world, first.number == y, drops);
  __syncwarp();
}

template <bool filtered, class T>
__global__ __launch_bounds__(32 * candidate_warps,
                             6) void near_candidates_kernel(const __grid_constant__ LaunchParams<T> params) {
  __shared__ NearLeaves spaces[candidate_warps];
  NearLeaves& s = spaces[threadIdx.x / 32];
  NearState state;
  FirstLeaf first;
  for_leaf_pairs(params, [&](u64 begin, u64 end) {
    const LeafPairsAhead ahead(params, begin, end);
    const u32 n = static_cast<u32>(end - begin);
#pragma unroll 1
    for (u32 k = 0; k < n; ++k) {
      const uint2 pair = ahead.pair(k);
      if (pair.x != first.number) {
        first = {pair.x, world_of_leaves(params, pair), ahead.first(k)};
        stage_first(params, s, first);
      }
      near_candidates<filtered>(params, s, state, first, pair.y, ahead.second(k));
    }
  });
  if (state.n > 0) flush_candidates(params, s, state);
  if (lane_number() == 0)
    for (u32 k = 0; k < 2; ++k) atomicAdd(&params.counters->candidates[k], static_cast<u64>(state.tested[k]));
  if constexpr (filtered)
    for (u32 k = 0; k < 2; ++k) add_up(&params.counters->ignored[k], state.ignored[k]);
}

}  // namespace hpccd::gpu
