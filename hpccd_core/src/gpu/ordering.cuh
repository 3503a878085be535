// SPDX-License-Identifier: Apache-2.0
// What a frame found, in canonical order, without a sort: pairs are counted by their first feature as they are found,
// so that each finds its place among those of other features by a sum, and among those of its own by looking at them.
// All on the device, without a look from the host (H100, cloth-ball: 0.03 ms; keys sorted by radix took 0.11).
#pragma once

#include "contacts/hash.h"
#include "gpu/best_time.cuh"

namespace hpccd::gpu {

// Where features have so many pairs that to look at all of a feature's takes too long, the host sorts keys instead.
inline constexpr u32 most_of_a_feature = 2048;

// A pair on its way to its place.
struct alignas(16) PlacedPair {
  u32 first, second;
  double toc;
};

// Of what the caller gets: places for so many rows.
struct ResultPlaces {
  uint2* vf;
  uint4* ee;
  uint3* ef;
  double* toc;  // of the vertex-face pairs, then of the others
  u64 most_vf, most_ee, most_ef;
};

template <class T>
__device__ u32 group_of(const LaunchParams<T>& params, const Candidate& pair) {
  return pair.kind == Kind::edge_edge ? params.n_vertices + pair.first : pair.first;
}

// first_of_group: how many pairs the groups before have.
template <class T>
__global__ void place_kernel(const __grid_constant__ LaunchParams<T> params, const u32* first_of_group,
                             PlacedPair* placed) {
  const u64 n = length(params.counters->found_all, params.found_capacity),
            stride = static_cast<u64>(gridDim.x) * blockDim.x;
  u32 most = 0;
  for (u64 i = static_cast<u64>(blockIdx.x) * blockDim.x + threadIdx.x; i < n; i += stride) {
    const Candidate pair = params.keys.pair_of(params.found_keys[i]);
    const u32 group = group_of(params, pair), left = atomicSub(&params.n_of_group[group], 1u);
    placed[first_of_group[group] + left - 1] = {pair.first, pair.second, params.found_tocs[i]};
    most = max(most, left);
  }
  __syncwarp();
  for (int d = 16; d > 0; d /= 2) most = max(most, __shfl_xor_sync(all_lanes, most, d));
  if (lane_number() == 0 && most) atomicMax(&params.counters->most_of_a_feature, u64{most});
}

// Writes rows as the caller sees them, and adds up their hash.
class RowWriter {
 public:
  __device__ explicit RowWriter(const ResultPlaces& to) : to_(to) {}

  template <class T>
  __device__ void write_contact(const LaunchParams<T>& params, u64 at, u64 n_vf, u32 first, u32 second, double toc) {
    to_.toc[at] = toc;
    soonest_ = fmin(soonest_, toc);
    if (at < n_vf) {
      to_.vf[at] = {first, second};
      hash_ += hash_of(Kind::vertex_face, first, second, toc);
    } else {
      const uint2 a = __ldg(params.edges + first), b = __ldg(params.edges + second);
      to_.ee[at - n_vf] = {a.x, a.y, b.x, b.y};
      hash_ += hash_of(Kind::edge_edge, pack(a.x, a.y), pack(b.x, b.y), toc);
    }
  }
  template <class T>
  __device__ void write_intersection(const LaunchParams<T>& params, u64 at, u32 edge, u32 face) {
    const uint2 e = __ldg(params.edges + edge);
    to_.ef[at] = {e.x, e.y, face};
    hash_ += hash_of(Kind::edge_face, pack(e.x, e.y), face, 0);
  }
  // By whole warps.
  __device__ void finish(Counters& c) {
    for (int d = 16; d > 0; d /= 2) hash_ += __shfl_xor_sync(all_lanes, hash_, d);
    if (lane_number() == 0 && hash_) atomicAdd(&c.hash, hash_);
    keep_soonest(&c.first_toc, soonest_);
  }

 private:
  const ResultPlaces& to_;
  u64 hash_ = 0;
  double soonest_ = INFINITY;
};

// Whether rows may be written at all: else the host sees why not, makes room or sorts, and asks again.
template <bool edges_and_faces>
__device__ inline bool fits(const Counters& c, const ResultPlaces& to, u64 found_capacity) {
  if (c.found_all > found_capacity) return false;
  return edges_and_faces ? c.found_all <= to.most_ef : c.found[0] <= to.most_vf && c.found[1] <= to.most_ee;
}

template <bool edges_and_faces, class T>
__global__ void results_kernel(const __grid_constant__ LaunchParams<T> params, const u32* first_of_group,
                               const PlacedPair* placed, const __grid_constant__ ResultPlaces to) {
  Counters& c = *params.counters;
  if (!fits<edges_and_faces>(c, to, params.found_capacity) || c.most_of_a_feature > most_of_a_feature) return;
  const u64 n = c.found_all, n_vf = c.found[0], stride = static_cast<u64>(gridDim.x) * blockDim.x;
  RowWriter rows(to);
  for (u64 i = static_cast<u64>(blockIdx.x) * blockDim.x + threadIdx.x; i < n; i += stride) {
    const PlacedPair own = placed[i];
    const u32 group = !edges_and_faces && i >= n_vf ? params.n_vertices + own.first : own.first;
    const u32 begin = first_of_group[group], end = first_of_group[group + 1];
    u64 at = begin;
    for (u32 k = begin; k < end; ++k) at += placed[k].second < own.second;
    if constexpr (edges_and_faces)
      rows.write_intersection(params, at, own.first, own.second);
    else
      rows.write_contact(params, at, n_vf, own.first, own.second, own.toc);
  }
  __syncwarp();
  rows.finish(c);
}

__global__ void number_kernel(u32* numbers, u32 n) {
  const u32 i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < n) numbers[i] = i;
}

// The same from sorted keys, and from which of what was found each comes.
template <bool edges_and_faces, class T>
__global__ void sorted_results_kernel(const __grid_constant__ LaunchParams<T> params, const u64* keys, const u32* order,
                                      const __grid_constant__ ResultPlaces to) {
  Counters& c = *params.counters;
  const u64 n = c.found_all, stride = static_cast<u64>(gridDim.x) * blockDim.x;
  RowWriter rows(to);
  for (u64 i = static_cast<u64>(blockIdx.x) * blockDim.x + threadIdx.x; i < n; i += stride) {
    const Candidate pair = params.keys.pair_of(keys[i]);
    if constexpr (edges_and_faces)
      rows.write_intersection(params, i, pair.first, pair.second);
    else
      rows.write_contact(params, i, c.found[0], pair.first, pair.second, params.found_tocs[order[i]]);
  }
  __syncwarp();
  rows.finish(c);
}

}  // namespace hpccd::gpu
