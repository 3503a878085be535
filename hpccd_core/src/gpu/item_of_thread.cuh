// SPDX-License-Identifier: Apache-2.0
// Kernels whose code is so deeply nested that a warp's threads do not reconverge. The hardware has sixteen barriers
// per warp. If nested branches need more, ptxas (13.0) stores them elsewhere, and waiting threads continue too early:
// in one of 100 frames the remaining threads took votes and loops of a part of the warp for those of the whole warp,
// and pairs were lost. Therefore each thread of such a kernel handles one item, writes its result, and ends; another
// kernel collects the results.
#pragma once

#include "gpu/launch_params.cuh"

namespace hpccd::gpu {

// The thread's item, if below n. Few items are spread over many warps, since a warp executes the branches of all its
// items; with many, neighbours take similar branches.
__device__ inline u64 item_of_thread(u64 n, u32 resident_warps) {
  const u64 warp = (static_cast<u64>(blockIdx.x) * blockDim.x + threadIdx.x) / 32;
  if (n > u64{8} * resident_warps) return warp * 32 + lane_number();
  return warp < resident_warps ? lane_number() * u64{resident_warps} + warp : n;
}

}  // namespace hpccd::gpu
