// SPDX-License-Identifier: Apache-2.0
// Brings the results of a frame into canonical order without a sort. Pairs are counted by their first feature when
// they are found. A prefix sum gives the position among other features, a comparison the position among pairs of the
// same feature. Everything runs on the device without involving the host (H100, cloth-ball: 0.03 ms; a radix sort of
// keys took 0.11).
#pragma once

#include "contacts/hash.h"
#include "gpu/best_time.cuh"

namespace hpccd::gpu {

// If a feature has more pairs than this, comparing all of them takes too long, and the host sorts keys instead.
inline constexpr u32 most_of_a_feature = 2048;

// A pair before it is placed.
struct alignas(16) PlacedPair {
  u32 first, second;
  double toc;
};

// The caller's arrays, with memory for this many rows.
struct ResultPlaces {
  uint2* vf;
  uint4* ee;
  uint3* ef;
  double* toc;  // of the vertex-face pairs, then of the others
  u64 most_vf, most_ee, most_ef;
  // For several worlds: offsets of the rows of each, and per-world results.
  u64 *vf_offsets, *ee_offsets, *hashes;
  double* first_tocs;
};

// f(i) for all contacts, of which there may be more than memory for them. Lanes reconverge afterwards.
template <class T, class Function>
__device__ void for_found(const LaunchParams<T>& params, Function&& f) {
  const u64 n = length(params.counters->found_all, params.found_capacity),
            stride = static_cast<u64>(gridDim.x) * blockDim.x;
  for (u64 i = static_cast<u64>(blockIdx.x) * blockDim.x + threadIdx.x; i < n; i += stride) f(i);
  __syncwarp();
}

template <class T>
__device__ WorldCounters& world_of(const LaunchParams<T>& params, const Candidate& pair) {
  return params.worlds[world_of(params, pair.kind, pair.first)];
}

// Whether a contact is among the results.
template <class T>
__device__ bool is_wanted(const LaunchParams<T>& params, u64 i, const Candidate& pair) {
  if (params.wanted == Wanted::all) return true;
  const WorldCounters& world = world_of(params, pair);
  return params.wanted == Wanted::earliest ? bits_of(params.found_tocs[i]) == ~world.first_toc
                                           : params.found_keys[i] == ~world.first_key;
}

// The earliest time, or the first pair, of each world.
template <class T>
__global__ void firsts_kernel(const __grid_constant__ LaunchParams<T> params) {
  for_found(params, [&](u64 i) {
    const u64 key = params.found_keys[i];
    WorldCounters& world = world_of(params, params.keys.pair_of(key));
    // Most contacts are later than those that others have found.
    if (params.wanted == Wanted::first) {
      if (~key > world.first_key) atomicMax(&world.first_key, ~key);
    } else if (const u64 toc = ~bits_of(params.found_tocs[i]); toc > world.first_toc) {
      atomicMax(&world.first_toc, toc);
    }
  });
}

// Before the results are computed again.
template <class T>
__global__ void forget_results_kernel(const __grid_constant__ LaunchParams<T> params) {
  const u32 k = blockIdx.x * blockDim.x + threadIdx.x;
  if (k == 0) {
    params.counters->most_of_a_feature = 0;
    params.counters->world.hash = params.counters->world.first_toc = 0;  // of all worlds together
  }
  if (k < params.n_worlds) params.worlds[k].hash = params.worlds[k].first_toc = params.worlds[k].first_key = 0;
}

// For pairs that were not counted when they were found.
template <class T>
__global__ void count_kernel(const __grid_constant__ LaunchParams<T> params, u32* n_of_group) {
  for_found(params, [&](u64 i) {
    const Candidate pair = params.keys.pair_of(params.found_keys[i]);
    if (!is_wanted(params, i, pair)) return;
    atomicAdd(&n_of_group[group_of(params, pair.kind, pair.first)], 1u);
  });
}

// first_of_group: number of pairs in previous groups.
template <class T>
__global__ void place_kernel(const __grid_constant__ LaunchParams<T> params, u32* n_of_group, const u32* first_of_group,
                             PlacedPair* placed) {
  Counters& c = *params.counters;
  if (blockIdx.x == 0 && threadIdx.x == 0) {
    c.rows[0] = first_of_group[params.all_vertices()];
    c.rows[1] = first_of_group[params.all_vertices() + params.all_edges()] - c.rows[0];
  }
  u32 most = 0;
  for_found(params, [&](u64 i) {
    const Candidate pair = params.keys.pair_of(params.found_keys[i]);
    if (!is_wanted(params, i, pair)) return;
    const u32 group = group_of(params, pair.kind, pair.first), left = atomicSub(&n_of_group[group], 1u);
    placed[first_of_group[group] + left - 1] = {pair.first, pair.second, params.found_tocs[i]};
    most = max(most, left);
  });
  for (int d = 16; d > 0; d /= 2) most = max(most, __shfl_xor_sync(all_lanes, most, d));
  if (lane_number() == 0 && most) atomicMax(&c.most_of_a_feature, u64{most});
}

// Writes rows in the caller's layout, with features numbered in their world, and adds up each world's hash. Lanes of a
// warp that call together add up the values of one world together.
template <class T>
class RowWriter {
 public:
  __device__ RowWriter(const LaunchParams<T>& params, const ResultPlaces& to) : params_(params), to_(to) {}

  __device__ void write_contact(u64 at, u64 n_vf, u32 first, u32 second, double toc) {
    to_.toc[at] = toc;
    if (at < n_vf) {
      const u32 world = params_.by_vertices(first), vertex = first - world * params_.n_vertices;
      to_.vf[at] = {vertex, second};
      add(world, hash_of(Kind::vertex_face, vertex, second, toc), toc);
    } else {
      const u32 world = params_.by_edges(first);
      const uint2 a = __ldg(params_.edges + first - world * params_.n_edges), b = __ldg(params_.edges + second);
      to_.ee[at - n_vf] = {a.x, a.y, b.x, b.y};
      add(world, hash_of(Kind::edge_edge, pack(a.x, a.y), pack(b.x, b.y), toc), toc);
    }
  }
  __device__ void write_intersection(u64 at, u32 edge, u32 face) {
    const u32 world = params_.by_edges(edge);
    const uint2 e = __ldg(params_.edges + edge - world * params_.n_edges);
    to_.ef[at] = {e.x, e.y, face};
    add(world, hash_of(Kind::edge_face, pack(e.x, e.y), face, 0), INFINITY);
  }
  // By whole warps.
  __device__ void finish() {
    u64 hash = world_ == 0 ? hash_ : 0;
    if (world_ != 0) give_up();
    for (int d = 16; d > 0; d /= 2) hash += __shfl_xor_sync(all_lanes, hash, d);
    if (lane_number() == 0 && hash) atomicAdd(&params_.worlds[0].hash, hash);
    keep_soonest(&params_.worlds[0].first_toc, world_ == 0 ? soonest_ : INFINITY);
  }

 private:
  // A thread's rows are nearly in the order of worlds: sums are kept until the world changes.
  __device__ void add(u32 world, u64 hash, double toc) {
    if (world != world_) {
      give_up();
      world_ = world, hash_ = 0, soonest_ = INFINITY;
    }
    hash_ += hash, soonest_ = fmin(soonest_, toc);
  }
  __device__ void give_up() {
    if (hash_) atomicAdd(&params_.worlds[world_].hash, hash_);
    if (const u64 toc = ~bits_of(soonest_); soonest_ < INFINITY && toc > params_.worlds[world_].first_toc)
      atomicMax(&params_.worlds[world_].first_toc, toc);
  }

  const LaunchParams<T>& params_;
  const ResultPlaces& to_;
  u32 world_ = 0;
  u64 hash_ = 0;
  double soonest_ = INFINITY;
};

// Whether there is memory for all rows: otherwise the host allocates it, and launches again.
template <bool edges_and_faces>
HPCCD_HD bool fit(const Counters& c, const ResultPlaces& to) {
  return edges_and_faces ? c.rows[0] + c.rows[1] <= to.most_ef : c.rows[0] <= to.most_vf && c.rows[1] <= to.most_ee;
}

template <bool edges_and_faces, class T>
__global__ void results_kernel(const __grid_constant__ LaunchParams<T> params, const u32* first_of_group,
                               const PlacedPair* placed, const __grid_constant__ ResultPlaces to) {
  Counters& c = *params.counters;
  if (!fit<edges_and_faces>(c, to) || c.most_of_a_feature > most_of_a_feature) return;
  const u64 n_vf = c.rows[0], n = n_vf + c.rows[1], stride = static_cast<u64>(gridDim.x) * blockDim.x;
  RowWriter<T> rows(params, to);
  for (u64 i = static_cast<u64>(blockIdx.x) * blockDim.x + threadIdx.x; i < n; i += stride) {
    const PlacedPair own = placed[i];
    const u32 group = !edges_and_faces && i >= n_vf ? params.all_vertices() + own.first : own.first;
    const u32 begin = first_of_group[group], end = first_of_group[group + 1];
    u64 at = begin;
    for (u32 k = begin; k < end; ++k) at += placed[k].second < own.second;
    if constexpr (edges_and_faces)
      rows.write_intersection(at, own.first, own.second);
    else
      rows.write_contact(at, n_vf, own.first, own.second, own.toc);
  }
  __syncwarp();
  rows.finish();
}

// For several worlds: offsets, per-world results, and totals. If rows were not written for lack of memory, hashes are
// still zero: launching again with the rows adds them once.
template <bool edges_and_faces, class T>
__global__ void worlds_kernel(const __grid_constant__ LaunchParams<T> params, const u32* first_of_group,
                              const __grid_constant__ ResultPlaces to) {
  Counters& c = *params.counters;
  const u64 n_vf = c.rows[0];
  const u32 k = blockIdx.x * blockDim.x + threadIdx.x;
  if (k <= params.n_worlds) {
    if constexpr (edges_and_faces) {
      to.vf_offsets[k] = k < params.n_worlds ? first_of_group[k * params.n_edges] : n_vf + c.rows[1];
    } else {
      to.vf_offsets[k] = first_of_group[k * params.n_vertices];
      to.ee_offsets[k] = first_of_group[params.all_vertices() + k * params.n_edges] - n_vf;
    }
  }
  u64 hash = 0;
  double soonest = INFINITY;
  if (k < params.n_worlds) {
    const WorldCounters& world = params.worlds[k];
    if (world.first_toc) soonest = __longlong_as_double(static_cast<long long>(~world.first_toc));
    to.hashes[k] = world.hash;
    to.first_tocs[k] = soonest;
    hash = hash_weight(k) * world.hash;
  }
  __syncwarp();
  for (int d = 16; d > 0; d /= 2) hash += __shfl_xor_sync(all_lanes, hash, d);
  if (lane_number() == 0 && hash) atomicAdd(&c.world.hash, hash);
  keep_soonest(&c.world.first_toc, soonest);
}

// For frames without rows.
__global__ void no_rows_kernel(u32 n_worlds, const __grid_constant__ ResultPlaces to) {
  const u32 k = blockIdx.x * blockDim.x + threadIdx.x;
  if (k <= n_worlds) to.vf_offsets[k] = to.ee_offsets[k] = 0;
  if (k < n_worlds) to.hashes[k] = 0, to.first_tocs[k] = INFINITY;
}

// Contacts that are not results go to the end, beyond the largest key.
template <class T>
__global__ void sortable_kernel(const __grid_constant__ LaunchParams<T> params, u64* keys, u32* numbers) {
  for_found(params, [&](u64 i) {
    const u64 key = params.found_keys[i];
    keys[i] = is_wanted(params, i, params.keys.pair_of(key)) ? key : u64{2} << params.keys.pair_bits;
    numbers[i] = static_cast<u32>(i);
  });
}

// The same from sorted keys, and the index of the contact of each.
template <bool edges_and_faces, class T>
__global__ void sorted_results_kernel(const __grid_constant__ LaunchParams<T> params, const u64* keys, const u32* order,
                                      const __grid_constant__ ResultPlaces to) {
  Counters& c = *params.counters;
  const u64 n_vf = c.rows[0], n = n_vf + c.rows[1], stride = static_cast<u64>(gridDim.x) * blockDim.x;
  RowWriter<T> rows(params, to);
  for (u64 i = static_cast<u64>(blockIdx.x) * blockDim.x + threadIdx.x; i < n; i += stride) {
    const Candidate pair = params.keys.pair_of(keys[i]);
    if constexpr (edges_and_faces)
      rows.write_intersection(i, pair.first, pair.second);
    else
      rows.write_contact(i, n_vf, pair.first, pair.second, params.found_tocs[order[i]]);
  }
  __syncwarp();
  rows.finish();
}

}  // namespace hpccd::gpu
