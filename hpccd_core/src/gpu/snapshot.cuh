// SPDX-License-Identifier: Apache-2.0
// Tests of one snapshot, which stands at t = 0: what is near (elementary/distance/proximity_test.h), and which edges
// meet which faces (elementary/intersection_filter.h).
#pragma once

#include "elementary/coincidence.h"
#include "elementary/distance/proximity_test.h"
#include "elementary/intersection_filter.h"
#include "gpu/pair_lists.cuh"

namespace hpccd::gpu {

// Whether the fallback would find at once that they touch.
template <Kind kind, class T>
__device__ inline bool certainly_touch(const LaunchParams<T>& params, uint4 v) {
  const u32 vertex[4] = {v.x, v.y, v.z, v.w};
  Vec3<double> q[4];
  for (int i = 0; i < 4; ++i) q[i] = load_ends(params.vertices, vertex[i]).t0;
  return share_a_place<kind == Kind::vertex_face ? 1 : 2>(q);
}

// Distances stand where contacts have their times.
template <Kind kind, class T>
__global__ __launch_bounds__(128) void proximity_kernel(const __grid_constant__ LaunchParams<T> params) {
  constexpr u32 k = kind == Kind::edge_edge;
  u32 n_near = 0, n_far = 0, n_undecided = 0;
  for_pairs(params.survivors[k], params.counters->survivors[k], [&](bool valid, uint2 pair) {
    bool near = false, undecided = false;
    double distance = 0;
    if (valid) {
      const uint4 v = vertices_of<kind>(params, pair.x, pair.y);
      const Motion<double> m = load_motion<kind>(params.vertices, v);
      const NearOrFar<double> o = proximity_test<kind>(Snapshot<double>{m.p0, m.a0, m.b0}, params.separation);
      const bool touch = !o.near && !o.far && certainly_touch<kind>(params, v);
      near = o.near || touch;
      undecided = !near && !o.far;
      distance = touch ? 0 : o.distance;
      n_far += o.far;
    }
    append_found(params, kind, near, pair, distance);
    append_to_host(params, kind, undecided, pair);
    n_near += near;
    n_undecided += undecided;
  });
  add_up(&params.counters->found[k], n_near);
  add_up(&params.counters->proven_near[k], n_near);
  add_up(&params.counters->apart[k], n_far);
  add_up(&params.counters->undecided_near[k], n_undecided);
}

template <class T>
__device__ inline void load_edge_face(const LaunchParams<T>& params, u32 edge, u32 face, Vec3<double> (&q)[5]) {
  const u32 world = params.by_edges(edge);
  const uint2 e = __ldg(params.edges + edge - world * params.n_edges);
  const u32* f = params.faces + 3 * static_cast<u64>(face);
  const u32 v[5] = {e.x, e.y, __ldg(f), __ldg(f + 1), __ldg(f + 2)};
  for (int i = 0; i < 5; ++i) q[i] = load_ends(params.vertices, world * params.n_vertices + v[i]).t0;
}

// Pairs of edge and face use the lists of the first kind.
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
