// SPDX-License-Identifier: Apache-2.0
// Hints: a few pairs that touched early in the previous frame. They give the next frame an upper bound on its earliest
// time before its boxes are built, so that boxes need not bound the motion after that time.
#pragma once

#include "elementary/distance/separation_test.h"
#include "gpu/best_time.cuh"
#include "gpu/elementary.cuh"
#include "gpu/stream.h"

namespace hpccd::gpu {

// Used before the vertices are in the arrays that load_motion reads.
template <class T>
__device__ PairEnds given_ends(const LaunchParams<T>& params, uint4 v) {
  const u32 vertex[4] = {v.x, v.y, v.z, v.w};
  PairEnds q;
  for (int i = 0; i < 4; ++i) {
    const u64 at = 3 * static_cast<u64>(vertex[i]);
    const T *a = params.given_t0 + at, *b = params.given_t1 + at;
    q.t0[i] = {a[0], a[1], a[2]}, q.t1[i] = {b[0], b[1], b[2]};
  }
  return q;
}

// Infinity if the device cannot decide that they touch.
template <Query query, Kind kind, class T>
__device__ double time_of(const LaunchParams<T>& params, uint2 pair) {
  const uint4 v = vertices_of<kind>(params, pair.x, pair.y);
  const PairEnds q = given_ends(params, v);
  const Motion<double> m = motion_of<kind>(q.t0, q.t1);
  const double separation = query == Query::separations ? separation_of(params, kind, pair, v.x, v.z) : 0;
  Outcome<double> o{};
  if (query == Query::separations && separation > 0) {
    o = separation_filter<kind>(m, separation);
    if (o.contact) return 0;
    if (!o.none) o = separation_test<kind>(m, separation);
  } else {
    const RootTests wanted = root_tests<kind>(m);
    if (!wanted.one && !wanted.many) return INFINITY;
    if (wanted.one) o = single_root_test<kind, Proven>(m);
    if (wanted.many) o = many_roots_test<kind, Proven>(m);
  }
  if (o.contact) return reported_time(reported_as(params, v), o.toc, o.delta);
  if (o.none || !params.hints_decided) return INFINITY;
  const FallbackAnswer answer = decide_on_device<kind>(q, accuracy_of(params, v), separation);
  return answer.contact ? answer.toc : INFINITY;
}

// One row of blocks per kind, so that both run concurrently.
template <Query query, class T>
__global__ __launch_bounds__(32) void hints_kernel(const __grid_constant__ LaunchParams<T> params) {
  const u32 k = blockIdx.y;
  for_pairs(params.hints[k], params.n_hints[k], [&](bool valid, uint2 pair) {
    const double time = !valid   ? INFINITY
                        : k == 0 ? time_of<query, Kind::vertex_face>(params, pair)
                                 : time_of<query, Kind::edge_edge>(params, pair);
    // Each lane separately: a warp may have diverged here (item_of_thread.cuh).
    if (time < INFINITY) atomicMax(&params.counters->soonest, ~bits_of(time));
  });
}

// Selects the hints for the next frame among the contacts: as many as fit of those that touch first or soon after,
// since a motion may separate the first ones.
template <class T>
__global__ void choose_hints_kernel(LaunchParams<T> params) {
  const u64 n = length(params.counters->found_all, params.found_capacity),
            stride = static_cast<u64>(gridDim.x) * blockDim.x;
  for (u64 i = static_cast<u64>(blockIdx.x) * blockDim.x + threadIdx.x; i - lane_number() < n; i += stride) {
    const bool wanted = i < n && counts_at(params, params.found_tocs[i]);
    const Candidate pair = params.keys.pair_of(wanted ? params.found_keys[i] : 0);
    const bool edges = pair.kind == Kind::edge_edge;
    append_pair(params.hints[0], &params.n_hints[0], wanted && !edges, {pair.first, pair.second});
    append_pair(params.hints[1], &params.n_hints[1], wanted && edges, {pair.first, pair.second});
  }
}

class Hints {
 public:
  template <class T>
  void fill(LaunchParams<T>& params) const {
    for (int k = 0; k < 2; ++k) params.hints[k] = {pairs_[k].data(), pairs_[k].size()};
    params.n_hints = n_.data(), params.hints_decided = decided_;
  }
  void reserve(cudaStream_t stream) {
    for (auto& pairs : pairs_) pairs.reserve(most);
    n_.reserve(2);
    forget(stream);
  }

  // The contacts of the last frame that qualify; `best` is its earliest time, `proven` the earliest that error bounds
  // alone have proven. Does not wait for the stream.
  template <class T>
  void choose(const LaunchParams<T>& params, double proven, u64 n_found, cudaStream_t stream) {
    if (n_found == 0) return;  // also if the frame ended before a search: the hints have proven useful
    decided_ = proven > params.best + (params.best > 0 ? soon : 0);
    forget(stream);
    choose_hints_kernel<<<std::min(blocks_for(n_found, 256), 256u), 256, 0, stream>>>(params);
    check_launch("choose_hints_kernel");
  }

  static constexpr std::size_t most = 1024;  // of each kind
  std::size_t bytes() const { return pairs_[0].bytes() + pairs_[1].bytes() + n_.bytes(); }

 private:
  void forget(cudaStream_t stream) { check(cudaMemsetAsync(n_.data(), 0, 2 * sizeof(u64), stream), "cudaMemsetAsync"); }

  DeviceBuffer<uint2> pairs_[2];  // by kind
  DeviceBuffer<u64> n_;
  // Whether the fallback must decide hints: error bounds alone would not have given the last frame its bound, or only a
  // fallback can decide that features touch at the start, which would end the search. Otherwise deciding what they
  // leave open is not worth 0.1 ms.
  bool decided_ = false;
};

}  // namespace hpccd::gpu
