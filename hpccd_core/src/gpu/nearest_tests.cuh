// SPDX-License-Identifier: Apache-2.0
// Elementary tests of candidates for the nearest features, a warp at a time, and what follows from them.
#pragma once

#include "gpu/nearest_task.cuh"
#include "gpu/snapshot.cuh"

namespace hpccd::gpu {

// Of both features. A search whose boxes have not grown by the thickness has it apart from the frame's.
__device__ inline double thickness_of(const Thicknesses& t, Kind kind, uint2 pair) {
  return kind == Kind::edge_edge ? t.of_edge[pair.x] + t.of_edge[pair.y] : t.of_vertex[pair.x] + t.of_face[pair.y];
}

template <class T>
__device__ inline Vec3<double> position_of(const LaunchParams<T>& params, u32 world, u32 vertex) {
  const Vec3<T> x = load_start(params.vertices, world * params.n_vertices + vertex);
  return {x.x, x.y, x.z};
}

// The positions of a pair: four, or five of an edge and a face.
template <class T>
__device__ inline void positions_of(const LaunchParams<T>& params, u32 world, Kind kind, uint2 pair,
                                    Vec3<double> (&q)[5]) {
  u32 v[5] = {};
  if (kind == Kind::edge_edge) {
    const uint2 a = __ldg(params.edges + pair.x), b = __ldg(params.edges + pair.y);
    v[0] = a.x, v[1] = a.y, v[2] = b.x, v[3] = b.y, v[4] = b.y;
  } else {
    const u32* f = params.faces + 3 * static_cast<u64>(pair.y);
    const u32 c[3] = {__ldg(f), __ldg(f + 1), __ldg(f + 2)};
    if (kind == Kind::vertex_face) {
      v[0] = pair.x, v[1] = c[0], v[2] = c[1], v[3] = c[2], v[4] = c[2];
    } else {
      const uint2 e = __ldg(params.edges + pair.x);
      v[0] = e.x, v[1] = e.y, v[2] = c[0], v[3] = c[1], v[4] = c[2];
    }
  }
  for (int i = 0; i < 5; ++i) q[i] = position_of(params, world, v[i]);
}

enum class Outcome : unsigned char { no, yes, undecided };

struct Nearness {
  Outcome outcome;
  double distance;
};

// Whether two features are within d; test_proximity for one pair.
template <Kind kind, class T>
__device__ __forceinline__ Nearness nearness(const LaunchParams<T>& params, u32 world, uint2 pair, double d) {
  Vec3<double> all[5];
  positions_of(params, world, kind, pair, all);
  const Vec3<double> q[4] = {all[0], all[1], all[2], all[3]};
  const Motion<double> m = motion_of<kind>(q, q);
  const NearOrFar<double> o = proximity_test<kind>(Snapshot<double>{m.p0, m.a0, m.b0}, d);
  if (o.near) return {Outcome::yes, o.distance};
  if (o.far) return {Outcome::no, 0};
  return {share_a_place<kind == Kind::vertex_face ? 1 : 2>(q) ? Outcome::yes : Outcome::undecided, 0};
}

// Whether an edge meets a face; intersection_kernel for one pair.
template <class T>
__device__ __forceinline__ Outcome intersection_of(const LaunchParams<T>& params, u32 world, uint2 pair) {
  Vec3<double> q[5];
  positions_of(params, world, Kind::edge_face, pair, q);
  const EdgeFace<double> spans = edge_face(q);
  const Verdict<double> volumes = volume_test(spans);
  if (volumes.yes) return Outcome::yes;
  if (volumes.no || certainly_apart_in_projection(spans)) return Outcome::no;
  return share_a_place<2>(q) ? Outcome::yes : Outcome::undecided;
}

// All lanes must call.
__device__ inline void append_undecided(const NearestTask& task, bool wanted, u32 of, Kind kind, uint2 pair) {
  const u64 at = warp_append(&task.counters->undecided, wanted);
  if (wanted && at < task.undecided_capacity) task.undecided[at] = {of, static_cast<u32>(kind), pair.x, pair.y};
}

// Offers the best pair of each pair of meshes in the warp. All lanes must call.
__device__ inline void offer(const NearestTask& task, bool wanted, u32 of, double distance, u64 key,
                             double without_thickness) {
  for (u32 left = __ballot_sync(all_lanes, wanted); left;) {
    const u32 now = __shfl_sync(all_lanes, of, __ffs(left) - 1);
    const bool mine = wanted && of == now;
    double least = mine ? distance : INFINITY;
    for (int d = 16; d > 0; d /= 2) least = fmin(least, __shfl_xor_sync(all_lanes, least, d));
    u64 first = mine && distance == least ? key : no_pair;
    for (int d = 16; d > 0; d /= 2) first = min(first, __shfl_xor_sync(all_lanes, first, d));
    if (mine && distance == least && key == first) offer_locked(task.so_far[now], distance, key, without_thickness);
    __syncwarp();
    left &= ~__ballot_sync(all_lanes, mine);
  }
}

// Tests one pair per lane. All lanes must call.
template <Kind kind, class T>
__device__ __noinline__ void test_nearest(const LaunchParams<T>& params, const NearestTask& task, bool valid,
                                          uint2 pair, u32 of) {
  bool near = false, undecided = false;
  double distance = 0, lack = 0;
  if (valid) {
    const NearestSoFar& s = task.so_far[of];
    const u32 world = of / task.n_pairs;
    if (task.thickness.of_vertex)
      lack = task.meshes[of - world * task.n_pairs].thickest - thickness_of(task.thickness, kind, pair);
    const double limit = limit_of(s) - lack;
    if (limit >= 0 && fresh(&s.intersecting) == no_pair) {
      const Nearness n = nearness<kind>(params, world, pair, limit);
      near = n.outcome == Outcome::yes, undecided = n.outcome == Outcome::undecided;
      distance = n.distance;
    }
  }
  // Of pairs at the same distance, the first in order is the result (NearestPair::before).
  const double whole = distance + lack;
  const bool wanted = near && bits_of(whole) <= fresh(&task.so_far[of].distance);
  offer(task, wanted, of, whole, key_of_nearest(kind, pair.x, pair.y), distance);
  append_undecided(task, undecided, of, kind, pair);
}

template <class T>
__device__ __noinline__ void test_intersection(const LaunchParams<T>& params, const NearestTask& task, bool valid,
                                               uint2 pair, u32 of) {
  Outcome outcome = Outcome::no;
  const u64 key = static_cast<u64>(pair.x) << 32 | pair.y;
  if (valid && key < fresh(&task.so_far[of].intersecting)) outcome = intersection_of(params, of / task.n_pairs, pair);
  if (outcome == Outcome::yes) atomicMin(&task.so_far[of].intersecting, key);
  append_undecided(task, outcome == Outcome::undecided, of, Kind::edge_face, pair);
}

}  // namespace hpccd::gpu
