// SPDX-License-Identifier: Apache-2.0
// Root tests in double precision of the pairs that the filters leave (elementary/batch.inl, test_proven).
#pragma once

#include "gpu/sieve.cuh"

namespace hpccd::gpu {

template <Kind kind, bool single>
__device__ __forceinline__ Outcome<double> root_test(const Motion<double>& m) {
  Outcome<double> o = single ? single_root_test<kind, Proven>(m) : test_in_doubles<kind>(m);
  // Few pairs are left undecided, so this filter is applied to them only.
  if (!o.contact && !o.none) {
    const Magnitudes<double> size = magnitudes(m);
    o.none = certainly_outside<kind>(m, size) && in_range(size);
  }
  return o;
}

template <Kind kind, bool single, class T>
__device__ __forceinline__ void seek_roots(const LaunchParams<T>& params) {
  constexpr u32 k = kind == Kind::edge_edge;
  Counters& c = *params.counters;
  u32 n_proven = 0, n_kept = 0, n_undecided = 0;
  for_pairs(single ? params.single[k] : params.many[k], single ? c.single[k] : c.many[k], [&](bool valid, uint2 pair) {
    bool contact = false, undecided = false;
    double toc = 0;
    if (valid) {
      const uint4 v = vertices_of<kind>(params, pair.x, pair.y);
      const Outcome<double> o = root_test<kind, single>(load_motion<kind>(params.vertices, v));
      contact = o.contact;
      undecided = !o.contact && !o.none;
      toc = reported_time(reported_as(params, v), o.toc, o.delta);
    }
    const bool counts = contact && counts_at(params, toc);
    append_found(params, kind, counts, pair, toc);
    append_undecided(params, kind, undecided, pair);
    n_proven += contact, n_kept += counts, n_undecided += undecided;
  });
  add_up(&c.proven[k], n_proven);
  add_up(&c.found[k], n_kept);
  add_up(&c.undecided_of[k], n_undecided);
}

// One row of blocks per kind, so that both run concurrently.
template <bool single, class T>
__global__ __launch_bounds__(128) void roots_kernel(const __grid_constant__ LaunchParams<T> params) {
  blockIdx.y == 0 ? seek_roots<Kind::edge_edge, single>(params) : seek_roots<Kind::vertex_face, single>(params);
}

// Clears the lists of one segment for the next; records their lengths and required lengths.
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

}  // namespace hpccd::gpu
