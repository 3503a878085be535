// SPDX-License-Identifier: Apache-2.0
// What a warp finds waits in shared memory for more: a place in the list of all is a wait for the counter.
#pragma once

#include "gpu/pair_lists.cuh"

namespace hpccd::gpu {

struct FoundQueue {
  static constexpr u32 room = 96;
  u64 keys[room];
  double tocs[room];
  u32 groups[room];
};

// All lanes must call.
template <class T>
__device__ __forceinline__ void flush_found(const LaunchParams<T>& params, const FoundQueue& s, u32& n) {
  __syncwarp();
  u64 base = 0;
  if (lane_number() == 0) base = atomicAdd(&params.counters->found_all, static_cast<u64>(n));
  base = __shfl_sync(all_lanes, base, 0);
  for (u32 i = lane_number(); i < n; i += 32) {
    if (base + i >= params.found_capacity) continue;
    params.found_keys[base + i] = s.keys[i];
    params.found_tocs[base + i] = s.tocs[i];
    if (params.n_of_group) atomicAdd(&params.n_of_group[s.groups[i]], 1u);
  }
  n = 0;
  __syncwarp();
}

// n: in the queue. All lanes must call.
template <class T>
__device__ __forceinline__ void queue_found(const LaunchParams<T>& params, FoundQueue& s, u32& n, Kind kind,
                                            bool wanted, uint2 pair, double toc) {
  const u32 mask = __ballot_sync(all_lanes, wanted);
  if (wanted) {
    const u32 at = n + __popc(mask & ((1u << lane_number()) - 1));
    s.keys[at] = params.keys.key_of(kind, pair.x, pair.y);
    s.tocs[at] = toc;
    s.groups[at] = group_of(params, kind, pair.x);
  }
  n += __popc(mask);
  if (n > FoundQueue::room - 32) flush_found(params, s, n);
}

}  // namespace hpccd::gpu
