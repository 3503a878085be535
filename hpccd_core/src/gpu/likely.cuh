// SPDX-License-Identifier: Apache-2.0
// The stages after the first filter for the tier `fast`: single precision, then double precision for pairs that it
// leaves undecided (elementary/batch.inl, test_likely). These bounds are not proven, so one filter does not imply what
// another would decide. The filters therefore run in the CPU's order, and both find the same contacts. One kernel
// processes all lists of a stage, with one row of blocks per list, so that they run concurrently.
#pragma once

#include "elementary/kdop_filter.h"
#include "gpu/sieve.cuh"

namespace hpccd::gpu {

// The k-DOP test of a pair (kdop_filter.inl).
template <Kind kind>
__device__ __forceinline__ bool kdops_apart(const VertexKdop* kdops, uint4 v) {
  const VertexKdop of[4] = {kdops[v.x], kdops[v.y], kdops[v.z], kdops[v.w]};
  bool apart = false;
  for (int k = 0; k < n_kdop_directions; ++k)
    apart = apart || in_order<kind>([&](int end, int i) { return end == 0 ? of[i].t0[k] : of[i].t1[k]; });
  return apart;
}

// Contacts must pass the k-DOP filter: the CPU applies it first, to all pairs; here it is more expensive than the other
// filters and comes last. Undecided pairs overwrite the survivors, which are no longer needed.
template <Kind kind, bool single, class T>
__device__ __forceinline__ void seek_likely_roots(const LaunchParams<T>& params) {
  constexpr u32 k = kind == Kind::edge_edge;
  Counters& c = *params.counters;
  u32 n_contacts = 0;
  for_pairs(single ? params.single[k] : params.many[k], single ? c.single[k] : c.many[k], [&](bool valid, uint2 pair) {
    bool contact = false, open = false;
    double toc = 0;
    if (valid) {
      const uint4 v = vertices_of<kind>(params, pair.x, pair.y);
      const Motion<float> m = load_rounded_motion<kind>(params.points, v);
      const Outcome<float> o = single ? single_root_test<kind, Likely>(m) : many_roots_test<kind, Likely>(m);
      open = !o.contact && !o.none;
      toc = o.toc;
      contact = o.contact && !kdops_apart<kind>(params.kdops, v);
    }
    append_found(params, kind, contact, pair, toc);
    append_pair(params.survivors[k], &c.open[k], open, pair);
    n_contacts += contact;
  });
  add_up(&c.proven[k], n_contacts);
  add_up(&c.found[k], n_contacts);
}

template <class T>
__global__ __launch_bounds__(128) void likely_roots_kernel(const __grid_constant__ LaunchParams<T> params) {
  switch (blockIdx.y) {
    case 0:
      return seek_likely_roots<Kind::edge_edge, true>(params);
    case 1:
      return seek_likely_roots<Kind::edge_edge, false>(params);
    case 2:
      return seek_likely_roots<Kind::vertex_face, true>(params);
    default:
      return seek_likely_roots<Kind::vertex_face, false>(params);
  }
}

template <Kind kind, class T>
__device__ __forceinline__ void decide_open(const LaunchParams<T>& params) {
  constexpr u32 k = kind == Kind::edge_edge;
  Counters& c = *params.counters;
  u32 n_contacts = 0, n_undecided = 0;
  for_pairs(params.survivors[k], c.open[k], [&](bool valid, uint2 pair) {
    Outcome<double> o{false, true, 0, 0};
    if (valid) {
      const uint4 v = vertices_of<kind>(params, pair.x, pair.y);
      o = test_in_doubles<kind>(load_motion<kind>(params.vertices, v));
    }
    const bool undecided = !o.contact && !o.none;
    append_found(params, kind, o.contact, pair, o.toc);
    append_undecided(params, kind, undecided, pair);
    n_contacts += o.contact, n_undecided += undecided;
  });
  add_up(&c.proven[k], n_contacts);
  add_up(&c.found[k], n_contacts);
  add_up(&c.undecided_of[k], n_undecided);
}

template <class T>
__global__ __launch_bounds__(128) void open_pairs_kernel(const __grid_constant__ LaunchParams<T> params) {
  blockIdx.y == 0 ? decide_open<Kind::edge_edge>(params) : decide_open<Kind::vertex_face>(params);
}

}  // namespace hpccd::gpu
