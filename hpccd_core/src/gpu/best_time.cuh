// SPDX-License-Identifier: Apache-2.0
// The best time so far of a frame that searches for the earliest contacts, and how much of its motion still matters
// (traverse/boxes_until.h).
#pragma once

#include "elementary/policy.h"
#include "gpu/pair_lists.cuh"

namespace hpccd::gpu {

// The bits of non-negative numbers have the order of the numbers.
__device__ inline u64 bits_of(double x) { return static_cast<u64>(__double_as_longlong(x)); }

// All lanes must call. Infinity means no time.
__device__ inline void keep_soonest(u64* counter, double time) {
  u64 soonest = time < INFINITY ? ~bits_of(time) : 0;
  for (int d = 16; d > 0; d /= 2) soonest = max(soonest, __shfl_xor_sync(all_lanes, soonest, d));
  if (lane_number() == 0 && soonest) atomicMax(counter, soonest);
}

template <class T>
__device__ double best_time(const LaunchParams<T>& params) {
  const u64 soonest = params.counters->soonest;
  return soonest ? fmin(params.best, __longlong_as_double(static_cast<long long>(~soonest))) : params.best;
}

// Pairs that touch later do not matter; 1: all do.
template <class T>
__device__ double until(const LaunchParams<T>& params) {
  return fmin((best_time(params) + same_time) * (1 + 1e-12), 1.0);
}

// Contacts this soon after the earliest are good hints for the next frame.
inline constexpr double soon = 1.0 / 64;

// Whether a contact is kept: it may be among the earliest, or is such a hint.
template <class T>
__device__ bool counts_at(const LaunchParams<T>& params, double time) {
  return !params.until_best || time <= best_time(params) + soon;
}

// Whether no further result can matter, or the frame is rejected, in which case all boxes may overlap.
template <class T>
__device__ bool over(const LaunchParams<T>& params) {
  return params.counters->bad != 0 || (params.time_only && best_time(params) <= 0);
}

// The best time that error bounds have proven, before the fallback runs.
template <class T>
__global__ void soonest_kernel(LaunchParams<T> params) {
  const u64 n = length(params.counters->found_all, params.found_capacity),
            stride = static_cast<u64>(gridDim.x) * blockDim.x;
  double soonest = INFINITY;
  for (u64 i = static_cast<u64>(blockIdx.x) * blockDim.x + threadIdx.x; i < n; i += stride)
    soonest = fmin(soonest, params.found_tocs[i]);
  __syncwarp();
  keep_soonest(&params.counters->soonest, soonest);
  keep_soonest(&params.counters->soonest_proven, soonest);
}

}  // namespace hpccd::gpu
