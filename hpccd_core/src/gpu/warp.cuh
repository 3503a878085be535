// SPDX-License-Identifier: Apache-2.0
// Lanes of a warp.
#pragma once

#include "gpu/counters.cuh"

namespace hpccd::gpu {

inline constexpr u32 all_lanes = 0xFFFFFFFFu;

__device__ inline u32 lane_number() { return threadIdx.x & 31; }

// A place for each lane with `wants`, by one atomic operation per warp. All lanes must call.
__device__ inline u64 warp_append(u64* counter, bool wants) {
  const u32 mask = __ballot_sync(all_lanes, wants);
  if (!mask) return 0;
  const u32 lane = lane_number(), leader = __ffs(mask) - 1;
  u64 base = 0;
  if (lane == leader) base = atomicAdd(counter, static_cast<u64>(__popc(mask)));
  base = __shfl_sync(all_lanes, base, leader);
  return base + __popc(mask & ((1u << lane) - 1));
}

}  // namespace hpccd::gpu
