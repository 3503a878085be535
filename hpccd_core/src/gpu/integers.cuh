// SPDX-License-Identifier: Apache-2.0
// Exact arithmetic on the device: what twice the precision of doubles leaves open, in the CPU's integers
// (elementary/exact), a thread a pair; wider ones each time for what stays open. What those leave open goes to the
// host.
#pragma once

#include "elementary/exact/earliest.h"
#include "elementary/exact/given_motion.h"
#include "gpu/best_time.cuh"
#include "gpu/pair_ends.cuh"

namespace hpccd::gpu {

// In integers of so many limbs.
template <int limbs>
__device__ exact::Answer decide_in_integers(Kind kind, const PairEnds& q) {
  using Z = exact::Integer<limbs>;
  if (exact::boxes_apart(kind, q.t0, q.t1, 0)) return {true, {}};
  const exact::GivenMotion given(q.t0, q.t1);
  if (given.bits > exact::Widths<Z>::coordinate_bits) return {false, {}};
  return exact::earliest(given.query<Z>(kind));
}

// Few pairs are spread over many warps, which go the ways of all their pairs.
template <int limbs, class T>
__global__ __launch_bounds__(32) void integers_kernel(const __grid_constant__ LaunchParams<T> params) {
  Counters& c = *params.counters;
  const u64 n = length(c.open_in_integers[limbs - 1], params.open_capacity), n_warps = gridDim.x;
  const bool few = n <= 8 * n_warps;
  for (u64 begin = 0; begin < n; begin += 32 * n_warps) {
    const u64 i = begin + (few ? lane_number() * n_warps + blockIdx.x : u64{blockIdx.x} * 32 + lane_number());
    exact::Answer answer{true, {}};
    u64 key = 0;
    if (i < n) {
      key = params.open_in_integers[limbs - 1][i];
      const Candidate pair = params.keys.pair_of(key);
      answer = decide_in_integers<limbs>(pair.kind, load_pair_ends(params.vertices, vertices_of(params, pair)));
    }
    const bool contact = answer.decided && answer.toc;
    const double toc = contact ? *answer.toc : INFINITY;
    const Candidate pair = params.keys.pair_of(key);
    append_found(params, pair.kind, contact, {pair.first, pair.second}, toc);
    count_lanes(c.found, contact, pair.kind);
    count_lanes(c.by_integers, i < n && answer.decided, pair.kind);
    if (params.time_only) keep_soonest(&c.soonest, toc);
    if constexpr (limbs < integer_sizes)
      append_key(params.open_in_integers[limbs], params.open_capacity, &c.open_in_integers[limbs], !answer.decided,
                 key);
    else
      append_key(params.to_host, params.to_host_capacity, &c.to_host, !answer.decided, key);
  }
}

}  // namespace hpccd::gpu
