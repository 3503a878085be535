// SPDX-License-Identifier: Apache-2.0
// Code so deep that its threads do not come out of it as the warp that went in. Of a warp's barriers the hardware holds
// sixteen; where nested branches take more, ptxas (13.0) keeps them elsewhere, and threads that wait are let go too
// soon: in one of 100 frames those behind lost their pairs to votes and loops that they took for the whole warp's. So
// each thread of such a kernel has one item, writes what it has found, and ends; another kernel collects.
#pragma once

#include "gpu/launch_params.cuh"

namespace hpccd::gpu {

// Which of n items is the thread's, if below n. Few are spread over so many warps, as a warp goes the ways of all its
// items; of many, neighbours go similar ways.
__device__ inline u64 item_of_thread(u64 n, u32 resident_warps) {
  const u64 warp = (static_cast<u64>(blockIdx.x) * blockDim.x + threadIdx.x) / 32;
  if (n > u64{8} * resident_warps) return warp * 32 + lane_number();
  return warp < resident_warps ? lane_number() * u64{resident_warps} + warp : n;
}

}  // namespace hpccd::gpu
