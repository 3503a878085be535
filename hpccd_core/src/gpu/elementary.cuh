// SPDX-License-Identifier: Apache-2.0
// Decides which root tests a pair needs in double precision, and what decides the pair if error bounds do not: one
// thread per pair.
#pragma once

#include "elementary/apart_until.h"
#include "elementary/distance/extended_separation.h"
#include "elementary/filtered_test.h"
#include "elementary/tolerance_test.h"
#include "gpu/best_time.cuh"
#include "gpu/feature_pair.cuh"

namespace hpccd::gpu {

// The root tests that a pair needs, if any.
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

// The decision of the tier's fallback, if double precision or 106 bits suffice; otherwise the pair stays undecided.
struct FallbackAnswer {
  bool contact, open;
  double toc;
  bool tolerant = false;  // within a tolerance, for tiers without a promise
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
  return {a.contact, false, a.toc, true};
}

template <Kind kind, class T>
__device__ FallbackAnswer fallback(const LaunchParams<T>& params, uint4 v, double separation) {
  const PairEnds q = load_pair_ends(params.vertices, v);
  if (params.time_only && params.until_best && apart_until<kind>(q.t0, q.t1, until(params), separation)) return {};
  return decide_on_device<kind>(q, accuracy_of(params, v), separation);
}

// Pairs that the error bounds left undecided. A separate kernel for separations, whose registers would slow down the
// other pairs.
template <bool separations, class T>
__global__ __launch_bounds__(32) void fallback_kernel(const __grid_constant__ LaunchParams<T> params) {
  Counters& c = *params.counters;
  const u64 n = length(c.undecided, params.undecided_capacity), n_warps = gridDim.x;
  // A warp executes the branches of all its pairs: few pairs are spread over many warps. With many pairs, neighbours
  // take similar branches.
  const bool few = n <= 8 * n_warps;
  for (u64 begin = 0; begin < n; begin += 32 * n_warps) {
    const u64 i = begin + (few ? lane_number() * n_warps + blockIdx.x : u64{blockIdx.x} * 32 + lane_number());
    FallbackAnswer answer{false, false, 0};
    u64 key = 0;
    double separation = 0;
    if (i < n) {
      key = params.undecided[i];
      const Candidate pair = params.keys.pair_of(key);
      const Kind kind = pair.kind;
      const uint4 v = vertices_of(params, pair);
      if constexpr (separations) separation = separation_of(params, kind, {pair.first, pair.second}, v.x, v.z);
      answer = kind == Kind::edge_edge ? fallback<Kind::edge_edge>(params, v, separation)
                                       : fallback<Kind::vertex_face>(params, v, separation);
    }
    const Candidate pair = params.keys.pair_of(key);
    append_found(params, pair.kind, answer.contact, {pair.first, pair.second}, answer.toc);
    count_lanes(c.found, answer.contact, pair.kind);
    count_lanes(c.by_tolerance, answer.tolerant, pair.kind);
    count_lanes(c.by_extended, i < n && !answer.open && !answer.tolerant, pair.kind);
    if (params.time_only) keep_soonest(&c.soonest, answer.contact ? answer.toc : INFINITY);
    // The device's integers support contacts only.
    const bool here = params.integers_on_device && !(separations && separation > 0);
    append_key(params.open_in_integers[0], params.open_capacity, &c.open_in_integers[0], answer.open && here, key);
    append_key(params.to_host, params.to_host_capacity, &c.to_host, answer.open && !here, key);
  }
}

}  // namespace hpccd::gpu
