// SPDX-License-Identifier: Apache-2.0
// Reads and appends lists of pairs in kernels.
#pragma once

#include "gpu/launch_params.cuh"

namespace hpccd::gpu {

// The number of stored entries of a list.
__device__ inline u64 length(u64 counted, u64 capacity) { return counted < capacity ? counted : capacity; }

// f(pair or nothing) for each pair of a list, whole warps at a time.
template <class Function>
__device__ void for_pairs(const PairList& list, u64 counted, Function&& function) {
  const u64 n = length(counted, list.capacity), stride = static_cast<u64>(gridDim.x) * blockDim.x;
  const u64 first = static_cast<u64>(blockIdx.x) * blockDim.x + threadIdx.x;
  for (u64 i = first; i - lane_number() < n; i += stride) {
    const bool valid = i < n;
    function(valid, valid ? list.pairs[i] : uint2{0, 0});
  }
}

// The same, with load(numbers(pair)), both prefetched: numbers while the previous pair is processed, and the data that
// they refer to when f calls its last argument. Without a pair, the first features are loaded.
template <class Numbers, class Load, class Function>
__device__ __forceinline__ void for_pairs_loaded_ahead(const PairList& list, u64 counted, Numbers&& numbers,
                                                       Load&& load, Function&& function) {
  const u64 n = length(counted, list.capacity), stride = static_cast<u64>(gridDim.x) * blockDim.x;
  u64 i = static_cast<u64>(blockIdx.x) * blockDim.x + threadIdx.x;
  if (i - lane_number() >= n) return;
  const auto pair_at = [&](u64 at) { return at < n ? list.pairs[at] : uint2{0, 0}; };
  uint2 pair = pair_at(i), next = pair_at(i + stride);
  auto loaded = load(numbers(pair));
  for (;;) {
    const auto next_numbers = numbers(next);
    const uint2 later = pair_at(i + 2 * stride);
    function(i < n, pair, loaded, [&] { loaded = load(next_numbers); });
    i += stride;
    if (i - lane_number() >= n) return;
    pair = next, next = later;
  }
}

// All lanes must call.
__device__ inline void append_pair(const PairList& list, u64* counter, bool wanted, uint2 pair) {
  const u64 at = warp_append(counter, wanted);
  if (wanted && at < list.capacity) list.pairs[at] = pair;
}

template <class T>
__device__ void append_found(const LaunchParams<T>& params, Kind kind, bool wanted, uint2 pair, double toc) {
  const u64 at = warp_append(&params.counters->found_all, wanted);
  if (wanted && at < params.found_capacity) {
    params.found_keys[at] = params.keys.key_of(kind, pair.x, pair.y);
    params.found_tocs[at] = toc;
    if (params.n_of_group) atomicAdd(&params.n_of_group[group_of(params, kind, pair.x)], 1u);
  }
}

// All lanes must call.
__device__ inline void append_key(u64* keys, u64 capacity, u64* counter, bool wanted, u64 key) {
  const u64 at = warp_append(counter, wanted);
  if (wanted && at < capacity) keys[at] = key;
}

// Leaves the pair to the fallback.
template <class T>
__device__ void append_undecided(const LaunchParams<T>& params, Kind kind, bool wanted, uint2 pair) {
  append_key(params.undecided, params.undecided_capacity, &params.counters->undecided, wanted,
             params.keys.key_of(kind, pair.x, pair.y));
}

// Leaves the pair to the CPU.
template <class T>
__device__ void append_to_host(const LaunchParams<T>& params, Kind kind, bool wanted, uint2 pair) {
  append_key(params.to_host, params.to_host_capacity, &params.counters->to_host, wanted,
             params.keys.key_of(kind, pair.x, pair.y));
}

// Counts lanes by the kind of their pairs. All lanes must call.
__device__ inline void count_lanes(u64 counters[2], bool counts, Kind kind) {
  for (u32 k = 0; k < 2; ++k) {
    const u32 mask = __ballot_sync(all_lanes, counts && (kind == Kind::edge_edge) == (k == 1));
    if (lane_number() == 0 && mask) atomicAdd(&counters[k], static_cast<u64>(__popc(mask)));
  }
}

// Adds the counts of all lanes.
__device__ inline void add_up(u64* counter, u32 n) {
  for (int d = 16; d > 0; d /= 2) n += __shfl_xor_sync(all_lanes, n, d);
  if (lane_number() == 0 && n) atomicAdd(counter, static_cast<u64>(n));
}

}  // namespace hpccd::gpu
