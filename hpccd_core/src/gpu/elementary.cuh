// SPDX-License-Identifier: Apache-2.0
// The later filters and the elementary tests (elementary/batch.inl), a thread a pair, each stage over the compacted
// survivors of the one before.
#pragma once

#include "elementary/apart_until.h"
#include "elementary/distance/extended_separation.h"
#include "elementary/filtered_test.h"
#include "elementary/tolerance_test.h"
#include "gpu/best_time.cuh"

namespace hpccd::gpu {

// Which of the root tests a pair needs, if any.
struct RootTests {
  bool one, many;
};

template <Kind kind>
__device__ __forceinline__ RootTests root_tests(const Motion<double>& m) {
  const Magnitudes<double> size = magnitudes(m);
  const bool usable = in_range(size);
  const bool passes = !(certainly_outside<kind>(m, size) && usable);
  const bool single = certainly_one_root(coplanarity(m), error_of<Proven>(size).coefficient) && usable;
  return {passes && single, passes && !single};
}

template <Kind kind, class T>
__device__ __forceinline__ RootTests root_tests(const LaunchParams<T>& params, uint2 pair) {
  return root_tests<kind>(load_motion<kind>(params.vertices, vertices_of<kind>(params, pair.x, pair.y)));
}

template <class T>
__device__ __forceinline__ void append_to_root_tests(const LaunchParams<T>& params, u32 k, uint2 pair,
                                                     RootTests wanted) {
  append_pair(params.single[k], &params.counters->single[k], wanted.one, pair);
  append_pair(params.many[k], &params.counters->many[k], wanted.many, pair);
}

template <Kind kind, class T>
__global__ __launch_bounds__(128) void projection_kernel(const __grid_constant__ LaunchParams<T> params) {
  constexpr u32 k = kind == Kind::edge_edge;
  for_pairs(params.survivors[k], params.counters->survivors[k], [&](bool valid, uint2 pair) {
    append_to_root_tests(params, k, pair, valid ? root_tests<kind>(params, pair) : RootTests{false, false});
  });
}

template <Kind kind, bool single, class T>
__global__ __launch_bounds__(128) void roots_kernel(const __grid_constant__ LaunchParams<T> params) {
  constexpr u32 k = kind == Kind::edge_edge;
  const PairList& list = single ? params.single[k] : params.many[k];
  u32 proven = 0, kept = 0, doubtful = 0;
  for_pairs(list, single ? params.counters->single[k] : params.counters->many[k], [&](bool valid, uint2 pair) {
    bool contact = false, undecided = false;
    double toc = 0;
    if (valid) {
      const uint4 v = vertices_of<kind>(params, pair.x, pair.y);
      const Motion<double> m = load_motion<kind>(params.vertices, v);
      const Outcome<double> o = single ? single_root_test<kind, Proven>(m) : many_roots_test<kind, Proven>(m);
      contact = o.contact;
      undecided = !o.contact && !o.none;
      toc = reported_time(reported_as(params, v), o.toc, o.delta);
    }
    const bool counts = contact && counts_at(params, toc);
    append_found(params, kind, counts, pair, toc);
    append_undecided(params, kind, undecided, pair);
    proven += contact;
    kept += counts;
    doubtful += undecided;
  });
  for (int d = 16; d > 0; d /= 2) {
    proven += __shfl_xor_sync(all_lanes, proven, d);
    kept += __shfl_xor_sync(all_lanes, kept, d);
    doubtful += __shfl_xor_sync(all_lanes, doubtful, d);
  }
  if (lane_number() != 0) return;
  if (proven) atomicAdd(&params.counters->proven[k], static_cast<u64>(proven));
  if (kept) atomicAdd(&params.counters->found[k], static_cast<u64>(kept));
  if (doubtful) atomicAdd(&params.counters->undecided_of[k], static_cast<u64>(doubtful));
}

// Clears the lists of one segment for the next; remembers how long they were and how long they had to be.
template <class T>
__global__ void end_segment_kernel(LaunchParams<T> params) {
  Counters& c = *params.counters;
  c.next_leaf_pair = 0;
  for (int k = 0; k < 2; ++k) {
    c.most_survivors = c.survivors[k] > c.most_survivors ? c.survivors[k] : c.most_survivors;
    c.most_single = c.single[k] > c.most_single ? c.single[k] : c.most_single;
    c.most_many = c.many[k] > c.most_many ? c.many[k] : c.most_many;
    c.most_separated = c.separated[k] > c.most_separated ? c.separated[k] : c.most_separated;
    c.all_survivors[k] += c.survivors[k];
    c.all_single[k] += c.single[k];
    c.all_many[k] += c.many[k];
    c.survivors[k] = c.single[k] = c.many[k] = c.separated[k] = c.open[k] = 0;
  }
}

// A pair at both ends of its motion, in the order of pair_vertices.
struct PairEnds {
  Vec3<double> t0[4], t1[4];
};

template <class T>
__device__ __forceinline__ PairEnds load_pair_ends(const GivenEnds<T>* vertices, uint4 v) {
  const Ends r[4] = {load_ends(vertices, v.x), load_ends(vertices, v.y), load_ends(vertices, v.z),
                     load_ends(vertices, v.w)};
  return {{r[0].t0, r[1].t0, r[2].t0, r[3].t0}, {r[0].t1, r[1].t1, r[2].t1, r[3].t1}};
}

// The answer of the tier's fallback where double precision or twice that is enough; else it is the host's to give.
struct FallbackAnswer {
  bool contact, host;
  double toc;
};

template <Kind kind>
__device__ FallbackAnswer decide_on_device(const PairEnds& q, Accuracy accuracy, double separation) {
  if (separation > 0) {
    const extended_precision::Answer a = extended_precision::earliest_within<kind>(q.t0, q.t1, separation);
    return {a.contact, !a.contact && !a.none, a.toc};
  }
  if (accuracy == Accuracy::exact || accuracy == Accuracy::conservative) {
    const extended_precision::Answer a = extended_precision::decide<kind>(q.t0, q.t1);
    return {a.contact, !a.contact && !a.none, a.toc};
  }
  const tolerance_test::Answer a = tolerance_test::contact<kind>(q.t0, q.t1);
  return {a.contact, false, a.toc};
}

template <Kind kind, bool separations, class T>
__device__ FallbackAnswer fallback(const LaunchParams<T>& params, uint4 v) {
  const PairEnds q = load_pair_ends(params.vertices, v);
  const double separation = separations ? separation_of(params, v.x, v.z) : 0;
  if (params.time_only && params.until_best && apart_until<kind>(q.t0, q.t1, until(params), separation)) return {};
  return decide_on_device<kind>(q, accuracy_of(params, v), separation);
}

// What the error bounds left open. A kernel of its own where some pairs have a separation: the others' would be slower
// for its registers.
template <bool separations, class T>
__global__ __launch_bounds__(32) void fallback_kernel(const __grid_constant__ LaunchParams<T> params) {
  const u64 n = length(params.counters->undecided, params.undecided_capacity), n_warps = gridDim.x;
  // A warp goes the ways of all its pairs: few are spread over many warps. Of many, neighbours go similar ways.
  const bool few = n <= 8 * n_warps;
  for (u64 begin = 0; begin < n; begin += 32 * n_warps) {
    const u64 i = begin + (few ? lane_number() * n_warps + blockIdx.x : u64{blockIdx.x} * 32 + lane_number());
    FallbackAnswer answer{false, false, 0};
    u64 key = 0;
    uint2 pair{0, 0};
    Kind kind = Kind::vertex_face;
    if (i < n) {
      key = params.undecided[i];
      const Candidate candidate = params.keys.pair_of(key);
      kind = candidate.kind, pair = {candidate.first, candidate.second};
      const uint4 v = kind == Kind::edge_edge ? vertices_of<Kind::edge_edge>(params, pair.x, pair.y)
                                              : vertices_of<Kind::vertex_face>(params, pair.x, pair.y);
      answer = kind == Kind::edge_edge ? fallback<Kind::edge_edge, separations>(params, v)
                                       : fallback<Kind::vertex_face, separations>(params, v);
    }
    append_found(params, kind, answer.contact, pair, answer.toc);
    if (answer.contact) atomicAdd(&params.counters->found[kind == Kind::edge_edge], u64{1});
    if (params.time_only) keep_soonest(&params.counters->soonest, answer.contact ? answer.toc : INFINITY);
    const u64 at = warp_append(&params.counters->to_host, answer.host);
    if (answer.host && at < params.to_host_capacity) params.to_host[at] = key;
  }
}

}  // namespace hpccd::gpu
