// SPDX-License-Identifier: Apache-2.0
// Candidate pairs of features (traverse/leaf_pairs.inl) and the first filter, in one kernel. Candidates wait in shared
// memory until a warp is full, and only those that pass the sign test are written to device memory (a third of them on
// cloth-ball, a fifth on n-body).
#pragma once

#include <type_traits>

#include "elementary/distance/separation_test.h"
#include "elementary/filtered_test.h"
#include "gpu/candidate_space.cuh"
#include "gpu/pair_lists.cuh"

namespace hpccd::gpu {

// The state of a warp.
struct CandidateState {
  u32 n = 0, n_survivors[2] = {0, 0};
  u32 tested[2] = {0, 0};
  u32 ignored[2] = {0, 0};  // of this lane
};

template <class T>
__device__ void flush_survivors(const LaunchParams<T>& params, CandidateQueue& s, u32 kind, u32 n) {
  __syncwarp();
  u64 base = 0;
  if (lane_number() == 0) base = atomicAdd(&params.counters->survivors[kind], static_cast<u64>(n));
  base = __shfl_sync(all_lanes, base, 0);
  for (u32 i = lane_number(); i < n; i += 32)
    if (base + i < params.survivors[kind].capacity) params.survivors[kind].pairs[base + i] = s.survivors[kind][i];
  __syncwarp();
}

// Spans in the vertices of a pair (pair_vertices.h): the common start of p and a, then the ends of p, a and b.
template <Kind kind>
__device__ __forceinline__ uint4 span_ends(u32 v0, u32 v1, u32 v2, u32 v3) {
  using S = Spans<kind>;
  static_assert(S::a_from == S::p_from && S::b_from == (kind == Kind::edge_edge ? S::p_to : S::p_from));
  const u32 v[4] = {v0, v1, v2, v3};
  return {v[S::p_from], v[S::p_to], v[S::a_to], v[S::b_to]};
}

// The motion of one vertex for the first filter: proven filters run in double precision, all others in single precision
// first.
template <class Policy, class T>
__device__ __forceinline__ auto load_for_filter(const LaunchParams<T>& params, u32 v) {
  if constexpr (std::is_same_v<Policy, Proven>)
    return load_ends(params.vertices, v);
  else
    return load_rounded_ends(params.points, v);
}

// Whether a pair passes the first filter. One piece of code for both kinds, which differ in the start of b.
template <Query query, class Policy, class T>
__device__ __forceinline__ bool passes_filter(const LaunchParams<T>& params, uint4 v, uint2 features, bool edges) {
  const auto from = load_for_filter<Policy>(params, v.x), p = load_for_filter<Policy>(params, v.y),
             a = load_for_filter<Policy>(params, v.z), b = load_for_filter<Policy>(params, v.w);
  using R = decltype(from.t0.x);
  const Vec3<R> b_from0 = edges ? p.t0 : from.t0, b_from1 = edges ? p.t1 : from.t1;
  const Motion<R> m{p.t0 - from.t0, a.t0 - from.t0, b.t0 - b_from0, p.t1 - from.t1, a.t1 - from.t1, b.t1 - b_from1};
  // Without a separation both tests are bit-identical.
  if constexpr (query == Query::separations)
    return !planes_stay_apart(m,
                              separation_of(params, edges ? Kind::edge_edge : Kind::vertex_face, features, v.x, v.y));
  return !coplanarity_filter<Policy>(m).none;
}

// Tests the last candidates, at most 32.
template <Query query, class Policy, class T>
__device__ __forceinline__ void filter_candidates(const LaunchParams<T>& params, CandidateQueue& s,
                                                  CandidateState& state) {
  __syncwarp();
  const u32 lane = lane_number(), n = state.n < 32 ? state.n : 32;
  state.n -= n;
  bool survives = false, edges = false;
  uint2 features{0, 0};
  if (lane < n) {
    features = s.features[state.n + lane];
    edges = features.y & kind_bit;
    features.y &= ~kind_bit;
    survives = of_snapshot(query) || passes_filter<query, Policy>(params, s.vertices[state.n + lane], features, edges);
  }
#pragma unroll
  for (u32 kind = 0; kind < 2; ++kind) {
    const bool mine = edges == (kind == 1);
    state.tested[kind] += __popc(__ballot_sync(all_lanes, lane < n && mine));
    const u32 mask = __ballot_sync(all_lanes, survives && mine);
    if (survives && mine) s.survivors[kind][state.n_survivors[kind] + __popc(mask & ((1u << lane) - 1))] = features;
    state.n_survivors[kind] += __popc(mask);
    if (state.n_survivors[kind] >= 64) {
      flush_survivors(params, s, kind, state.n_survivors[kind]);
      state.n_survivors[kind] = 0;
    }
  }
  __syncwarp();
}

// The pair that a lane proposes for the list of candidates.
struct LanePair {
  bool wanted;
  uint4 vertices;
  uint2 features;
};

// Drops a pair that is never tested, or that a filter ignores. Intersections: an edge and a face.
template <Query query, class T>
__device__ __forceinline__ void drop_ignored(const LaunchParams<T>& params, CandidateState& state, LanePair& pair,
                                             u32 world) {
  if (!pair.wanted) return;
  const bool edges = pair.features.y & kind_bit;
  const uint2 features{pair.features.x, pair.features.y & ~kind_bit};
  constexpr bool edge_and_face = query == Query::intersections;
  if (is_never_tested<edge_and_face>(params, features, edges, world)) {
    pair.wanted = false;
    return;
  }
  if (!is_ignored<edge_and_face>(params, features, edges, world)) return;
  pair.wanted = false;
  ++(edges ? state.ignored[1] : state.ignored[0]);
}

// i / n for i < 1024 and n <= 32: exact, since the error i (magic n - 65536) / (65536 n) stays below 1 / n.
__device__ inline u32 magic_of(u32 n) { return (65536 + n - 1) / n; }

// first_edge: number of the first edge of the world.
template <Query query>
__device__ __forceinline__ LanePair edge_pair(const CandidateSpace& s, u32 first_edge, u32 i, u32 j, bool same,
                                              bool valid) {
  LanePair c{valid && (!same || i < j), {0, 0, 0, 0}, {0, 0}};
  if (!c.wanted) return c;
  const u32 side = same ? 0 : 1;
  const DeviceBox a = s.box(0, i), b = s.box(side, j);
  c.wanted = overlap<query>(a, b) && a.tag_low() != b.tag_low() && a.tag_low() != b.tag_high() &&
             a.tag_high() != b.tag_low() && a.tag_high() != b.tag_high();
  const u32 x = s.number[0][i], y = s.number[side][j];
  const uint2 ends_a{a.tag_low(), a.tag_high()}, ends_b{b.tag_low(), b.tag_high()};
  const uint2 lower = x < y ? ends_a : ends_b, upper = x < y ? ends_b : ends_a;
  c.vertices = span_ends<Kind::edge_edge>(lower.x, lower.y, upper.x, upper.y);
  c.features = {first_edge + (x < y ? x : y), (x < y ? y : x) | kind_bit};
  return c;
}

template <Query query>
__device__ __forceinline__ LanePair vertex_face_pair(const CandidateSpace& s, u32 i, u32 j, bool valid) {
  LanePair c{valid, {0, 0, 0, 0}, {0, 0}};
  if (!valid) return c;
  const DeviceBox vertex = s.box(0, i), face = s.box(1, j);
  const u32 v = vertex.tag_low(), f0 = face.tag_low(), f1 = face.tag_high(), f2 = s.corner2[j];
  c.vertices = span_ends<Kind::vertex_face>(v, f0, f1, f2);
  c.wanted = overlap<query>(vertex, face) && v != f0 && v != f1 && v != f2;
  c.features = {v, s.number[1][j]};
  return c;
}

// In edge-face pairs there is no order to choose.
template <Query query>
__device__ __forceinline__ LanePair edge_face_pair(const CandidateSpace& s, u32 first_edge, u32 i, u32 j, bool valid) {
  LanePair c{valid, {0, 0, 0, 0}, {0, 0}};
  if (!valid) return c;
  const DeviceBox edge = s.box(0, i), face = s.box(1, j);
  const u32 f[3] = {face.tag_low(), face.tag_high(), s.corner2[j]};
  c.wanted = overlap<query>(edge, face);
  for (const u32 v : f) c.wanted = c.wanted && edge.tag_low() != v && edge.tag_high() != v;
  c.features = {first_edge + s.number[0][i], s.number[1][j]};
  return c;
}

// The features of the two leaves that are paired in a phase: edges, vertices of the first leaf, vertices of the second;
// or edges of the first and edges of the second. Returns their numbers on each side.
template <Query query, class T>
__device__ __forceinline__ uint2 stage_phase(const LaunchParams<T>& params, CandidateSpace& s, uint2 pair, u32 phase) {
  constexpr bool edges_and_faces = query == Query::intersections;
  const u32 world = world_of_leaves(params, pair), first_leaf = world * params.n_leaves;
  const uint2 own{pair.x - first_leaf, pair.y};
  const bool same = own.x == own.y, swapped = phase == (edges_and_faces ? 1 : 2);
  const u32 x = first_leaf + (swapped ? own.y : own.x), y = first_leaf + (swapped ? own.x : own.y);
  const LeafCorners a = leaf_corners(params, swapped ? own.y : own.x, world),
                    b = leaf_corners(params, swapped ? own.x : own.y, world);
  u32 n_first;
  if constexpr (edges_and_faces) {
    n_first = stage_edges<query>(params, a, y, s, 0);
  } else if (phase == 0) {
    n_first = stage_edges<query>(params, a, y, s, 0);
    return {n_first, same ? n_first : stage_edges<query>(params, b, x, s, 1)};
  } else {
    n_first = stage_vertices<query>(params, a, y, s);
  }
  return {n_first, n_first ? stage_faces<query>(params, b, x, s) : 0};
}

// The filter occurs once, in the innermost loop: as a function it costs 30 million register spills on n-body,
// duplicated it overflows the instruction cache.
template <Query query, bool filtered, class T>
__device__ __forceinline__ void leaf_pair_candidates(const LaunchParams<T>& params, CandidateSpace& s,
                                                     CandidateState& state, uint2 pair) {
  constexpr bool edges_and_faces = query == Query::intersections;
  const u32 world = world_of_leaves(params, pair), own = pair.x - world * params.n_leaves;
  const bool same = own == pair.y;
  u32 phase = 0, end = (same ? 2 : 3) - (edges_and_faces ? 1 : 0);
  if constexpr (!edges_and_faces) {
    const u32 tested = tested_features(params, params.leaves[own], params.leaves[pair.y]);
    if (!(tested & tests_edge_edge)) phase = 1;
    if (!(tested & tests_vertex_face)) end = 1;
  }
  bool drops = false;
  if constexpr (filtered) drops = are_filtered(params, params.leaves[own], params.leaves[pair.y]);
#pragma unroll 1
  for (; phase < end; ++phase) {
    const uint2 n = stage_phase<query>(params, s, pair, phase);
    __syncwarp();
    const u32 total = n.x * n.y, magic = magic_of(n.y ? n.y : 1);
#pragma unroll 1
    for (u32 base = 0; base < total; base += 32) {
      const u32 c = base + lane_number(), i = c * magic >> 16, j = c - i * n.y;
      LanePair pushed;
      if constexpr (edges_and_faces)
        pushed = edge_face_pair<query>(s, world * params.n_edges, i, j, c < total);
      else
        pushed = phase == 0 ? edge_pair<query>(s, world * params.n_edges, i, j, same, c < total)
                            : vertex_face_pair<query>(s, i, j, c < total);
      if constexpr (filtered)
        if (drops) drop_ignored<query>(params, state, pushed, world);
      const u32 mask = __ballot_sync(all_lanes, pushed.wanted);
      const u32 at = state.n + __popc(mask & ((1u << lane_number()) - 1));
      if (pushed.wanted) {
        if constexpr (!of_snapshot(query)) s.vertices[at] = pushed.vertices;
        s.features[at] = pushed.features;
      }
      state.n += __popc(mask);
      if (state.n >= 32) filter_candidates<query, Proven>(params, s, state);
    }
    __syncwarp();
  }
}

// Tests the remaining candidates after the last pair of leaves.
template <Query query, class Policy, bool filtered, class T>
__device__ __forceinline__ void finish_candidates(const LaunchParams<T>& params, CandidateQueue& s,
                                                  CandidateState& state) {
  if (state.n > 0) filter_candidates<query, Policy>(params, s, state);
  for (u32 kind = 0; kind < 2; ++kind)
    if (state.n_survivors[kind] > 0) flush_survivors(params, s, kind, state.n_survivors[kind]);
  if (lane_number() == 0)
    for (u32 kind = 0; kind < 2; ++kind)
      atomicAdd(&params.counters->candidates[kind], static_cast<u64>(state.tested[kind]));
  if constexpr (filtered)
    for (u32 kind = 0; kind < 2; ++kind) add_up(&params.counters->ignored[kind], state.ignored[kind]);
}

// Takes a few pairs of leaves at a time, until this segment has no more.
template <class T, class Function>
__device__ __forceinline__ void for_leaf_pairs(const LaunchParams<T>& params, Function&& function) {
  constexpr u32 grain = 8;
  const u64 all = params.counters->leaf_pairs < params.leaf_pairs.capacity ? params.counters->leaf_pairs
                                                                           : params.leaf_pairs.capacity;
  const u64 from = all * params.segment / params.n_segments, to = all * (params.segment + 1) / params.n_segments;
#pragma unroll 1
  for (;;) {
    u64 begin = 0;
    if (lane_number() == 0) begin = from + atomicAdd(&params.counters->next_leaf_pair, static_cast<u64>(grain));
    begin = __shfl_sync(all_lanes, begin, 0);
    if (begin >= to) break;
    function(begin, begin + grain < to ? begin + grain : to);
  }
}

template <Query query, bool filtered, class T>
__global__ __launch_bounds__(32 * candidate_warps,
                             5) void candidates_kernel(const __grid_constant__ LaunchParams<T> params) {
  __shared__ CandidateSpace spaces[candidate_warps];
  CandidateSpace& s = spaces[threadIdx.x / 32];
  CandidateState state;
  for_leaf_pairs(params, [&](u64 begin, u64 end) {
#pragma unroll 1
    for (u64 k = begin; k < end; ++k)
      leaf_pair_candidates<query, filtered>(params, s, state, params.leaf_pairs.pairs[k]);
  });
  finish_candidates<query, Proven, filtered>(params, s, state);
}

}  // namespace hpccd::gpu
