// SPDX-License-Identifier: Apache-2.0
// Tests of one snapshot, at t = 0: pairs within a distance (elementary/distance/proximity_test.h), and edges that
// intersect faces (elementary/intersection_filter.h).
#pragma once

#include "elementary/coincidence.h"
#include "elementary/distance/proximity_test.h"
#include "elementary/intersection_filter.h"
#include "gpu/feature_pair.cuh"
#include "gpu/pair_lists.cuh"

namespace hpccd::gpu {

// A warp collects its results in shared memory: a position in the global list costs a wait for the counter.
struct FoundQueue {
  static constexpr u32 room = 96;
  u64 keys[room];
  double tocs[room];
  u32 groups[room];
};

// All lanes must call.
template <class T>
__device__ __forceinline__ void flush_found(const LaunchParams<T>& params, const FoundQueue& s, u32& n) {
  __syncwarp();
  u64 base = 0;
  if (lane_number() == 0) base = atomicAdd(&params.counters->found_all, static_cast<u64>(n));
  base = __shfl_sync(all_lanes, base, 0);
  for (u32 i = lane_number(); i < n; i += 32) {
    if (base + i >= params.found_capacity) continue;
    params.found_keys[base + i] = s.keys[i];
    params.found_tocs[base + i] = s.tocs[i];
    if (params.n_of_group) atomicAdd(&params.n_of_group[s.groups[i]], 1u);
  }
  n = 0;
  __syncwarp();
}

// n: number of elements in the queue. All lanes must call.
template <class T>
__device__ __forceinline__ void queue_found(const LaunchParams<T>& params, FoundQueue& s, u32& n, Kind kind,
                                            bool wanted, uint2 pair, double toc) {
  const u32 mask = __ballot_sync(all_lanes, wanted);
  if (wanted) {
    const u32 at = n + __popc(mask & ((1u << lane_number()) - 1));
    s.keys[at] = params.keys.key_of(kind, pair.x, pair.y);
    s.tocs[at] = toc;
    s.groups[at] = group_of(params, kind, pair.x);
  }
  n += __popc(mask);
  if (n > FoundQueue::room - 32) flush_found(params, s, n);
}

// Whether the fallback would find immediately that they touch.
template <Kind kind, class T>
__device__ inline bool certainly_touch(const LaunchParams<T>& params, uint4 v) {
  const u32 vertex[4] = {v.x, v.y, v.z, v.w};
  Vec3<double> q[4];
  for (int i = 0; i < 4; ++i) q[i] = load_ends(params.vertices, vertex[i]).t0;
  return share_a_place<kind == Kind::vertex_face ? 1 : 2>(q);
}

// Positions of a snapshot's vertices in the caller's precision.
__device__ inline Vec3<float> load_start(const GivenEnds<float>* vertices, u32 v) {
  const float4 a = __ldg(&vertices[v].t0);
  return {a.x, a.y, a.z};
}
__device__ inline Vec3<double> load_start(const GivenEnds<double>* vertices, u32 v) {
  const double2 a = __ldg(&vertices[v].t0[0]), b = __ldg(&vertices[v].t0[1]);
  return {a.x, a.y, b.x};
}

template <class T>
struct PairStarts {
  Vec3<T> x[4];
};

template <Kind kind, class T>
__device__ __forceinline__ Snapshot<double> snapshot_of(const PairStarts<T>& given) {
  Vec3<double> x[4];
  for (int i = 0; i < 4; ++i) x[i] = {given.x[i].x, given.x[i].y, given.x[i].z};
  const Motion<double> m = motion_of<kind>(x, x);
  return {m.p0, m.a0, m.b0};
}

// Distances take the place of times. With the queue, and with prefetching of the next pair's vertices, 40 million pairs
// take 1.9 ms instead of 2.8 (H100): warps waited for the counter of results.
template <Kind kind, class T>
__device__ __forceinline__ void test_proximity(const LaunchParams<T>& params, FoundQueue& queue) {
  constexpr u32 k = kind == Kind::edge_edge;
  u32 n_near = 0, n_far = 0, n_undecided = 0, n_queued = 0;
  const auto numbers = [&](uint2 pair) { return vertices_of<kind>(params, pair.x, pair.y); };
  const auto load = [&](uint4 v) {
    return PairStarts<T>{{load_start(params.vertices, v.x), load_start(params.vertices, v.y),
                          load_start(params.vertices, v.z), load_start(params.vertices, v.w)}};
  };
  const auto test = [&](bool valid, uint2 pair, const PairStarts<T>& given, auto&& load_next) {
    bool near = false, undecided = false;
    double distance = 0;
    if (valid) {
      const double thickness = thickness_of(params, kind, pair.x, pair.y);
      const NearOrFar<double> o = proximity_test<kind>(snapshot_of<kind>(given), params.separation + thickness);
      const bool touch = !o.near && !o.far && certainly_touch<kind>(params, numbers(pair));
      near = o.near || touch;
      undecided = !near && !o.far;
      distance = touch ? 0 : o.distance;
      if (params.thickness.of_vertex) distance = lesser(distance - thickness, params.separation);
      n_far += o.far;
    }
    load_next();
    queue_found(params, queue, n_queued, kind, near, pair, distance);
    append_to_host(params, kind, undecided, pair);
    n_near += near;
    n_undecided += undecided;
  };
  for_pairs_loaded_ahead(params.survivors[k], params.counters->survivors[k], numbers, load, test);
  if (n_queued > 0) flush_found(params, queue, n_queued);
  add_up(&params.counters->found[k], n_near);
  add_up(&params.counters->proven_near[k], n_near);
  add_up(&params.counters->apart[k], n_far);
  add_up(&params.counters->undecided_near[k], n_undecided);
}

inline constexpr u32 proximity_threads = 128;

// One row of blocks per kind, so that both run concurrently. (With six blocks per multiprocessor registers spill, and
// it is slower.)
template <class T>
__global__ __launch_bounds__(proximity_threads,
                             5) void proximity_kernel(const __grid_constant__ LaunchParams<T> params) {
  __shared__ FoundQueue queues[proximity_threads / 32];
  FoundQueue& queue = queues[threadIdx.x / 32];
  blockIdx.y == 0 ? test_proximity<Kind::edge_edge>(params, queue) : test_proximity<Kind::vertex_face>(params, queue);
}

template <class T>
__device__ inline void load_edge_face(const LaunchParams<T>& params, u32 edge, u32 face, Vec3<double> (&q)[5]) {
  const u32 world = params.by_edges(edge);
  const uint2 e = __ldg(params.edges + edge - world * params.n_edges);
  const u32* f = params.faces + 3 * static_cast<u64>(face);
  const u32 v[5] = {e.x, e.y, __ldg(f), __ldg(f + 1), __ldg(f + 2)};
  for (int i = 0; i < 5; ++i) q[i] = load_ends(params.vertices, world * params.n_vertices + v[i]).t0;
}

// Edge-face pairs use the lists of the first kind.
template <class T>
__global__ __launch_bounds__(128) void intersection_kernel(const __grid_constant__ LaunchParams<T> params) {
  constexpr u32 k = 0;
  u32 n_found = 0, n_apart = 0, n_undecided = 0;
  for_pairs(params.survivors[k], params.counters->survivors[k], [&](bool valid, uint2 pair) {
    bool intersect = false, undecided = false;
    if (valid) {
      Vec3<double> q[5];
      load_edge_face(params, pair.x, pair.y, q);
      const EdgeFace<double> spans = edge_face(q);
      const Verdict<double> volumes = volume_test(spans);
      const bool open = !volumes.yes && !volumes.no && !certainly_apart_in_projection(spans);
      intersect = volumes.yes || (open && share_a_place<2>(q));
      undecided = open && !intersect;
      n_apart += !intersect && !undecided;
    }
    append_found(params, Kind::vertex_face, intersect, pair, 0);
    append_to_host(params, Kind::vertex_face, undecided, pair);
    n_found += intersect;
    n_undecided += undecided;
  });
  add_up(&params.counters->found[k], n_found);
  add_up(&params.counters->proven_near[k], n_found);
  add_up(&params.counters->apart[k], n_apart);
  add_up(&params.counters->undecided_near[k], n_undecided);
}

}  // namespace hpccd::gpu
