// SPDX-License-Identifier: Apache-2.0
// The stages after the first filter in single precision: the remaining pairs, sorted by the roots that they may have.
// Tiers with a promise use proven bounds, and search the roots in double precision (elementary/batch.inl,
// test_proven). The tier `fast` uses likely bounds (likely.cuh).
#pragma once

#include "gpu/elementary.cuh"

namespace hpccd::gpu {

struct SortedPair {
  RootTests wanted;
  bool missed;  // apart at the only root
};

template <Kind kind, class Policy, class R>
__device__ __forceinline__ SortedPair sort_out(const Motion<R>& m) {
  const Magnitudes<R> size = magnitudes(m);
  const Cubic<R> f = coplanarity(m);
  const CubicError<R> error = error_of<Policy>(size);
  const bool usable = in_range(size);
  // Pairs of a near list have not passed a filter yet.
  if (certainly_no_root(f, error.coefficient) && usable) return {{false, false}, false};
  if (certainly_one_root(f, error.coefficient) && usable) {
    const bool missed = certainly_apart_at_root<kind>(m, size, f, error.value);
    return {{!missed, false}, missed};
  }
  return {{false, !(certainly_outside<kind>(m, size) && usable)}, false};
}

template <Kind kind, class Policy, class T>
__device__ __forceinline__ void sort_survivors(const LaunchParams<T>& params) {
  constexpr u32 k = kind == Kind::edge_edge;
  Counters& c = *params.counters;
  u32 n_missed = 0;
  for_pairs(params.survivors[k], c.survivors[k], [&](bool valid, uint2 pair) {
    SortedPair sorted{{false, false}, false};
    if (valid) {
      const uint4 v = vertices_of<kind>(params, pair.x, pair.y);
      sorted = sort_out<kind, Policy>(load_rounded_motion<kind>(params.points, v));
      // The only root up to the best time need not be the only one of the step.
      if (params.until_best) sorted.wanted = {false, sorted.wanted.one || sorted.wanted.many};
    }
    append_to_root_tests(params, k, pair, sorted.wanted);
    n_missed += sorted.missed;
  });
  add_up(&c.missed[k], n_missed);
}

// One row of blocks per kind, so that both run concurrently.
template <class Policy, class T>
__global__ __launch_bounds__(128) void sort_survivors_kernel(const __grid_constant__ LaunchParams<T> params) {
  blockIdx.y == 0 ? sort_survivors<Kind::edge_edge, Policy>(params) : sort_survivors<Kind::vertex_face, Policy>(params);
}

// Starts without information, so that the bits of the time do not depend on previous tests.
template <Kind kind>
__device__ __forceinline__ Outcome<double> test_in_doubles(const Motion<double>& m) {
  const RootTests wanted = sort_out<kind, Proven>(m).wanted;
  if (wanted.one) return single_root_test<kind, Proven>(m);
  if (wanted.many) return many_roots_test<kind, Proven>(m);
  return {false, true, 0, 0};
}

}  // namespace hpccd::gpu
