// SPDX-License-Identifier: Apache-2.0
// Exact arithmetic on the device, for pairs that 106 bits leave undecided, in the CPU's integers (elementary/exact),
// one thread per pair. Each stage uses wider integers for the pairs that the previous one left. The rest goes to the
// host.
#include "elementary/exact/earliest.h"
#include "elementary/exact/given_motion.h"
#include "gpu/best_time.cuh"
#include "gpu/feature_pair.cuh"
#include "gpu/item_of_thread.cuh"
#include "gpu/stages.cuh"

namespace hpccd::gpu {

namespace {

// In integers of `limbs` limbs.
template <int limbs>
__device__ exact::Answer decide_in_integers(Kind kind, const PairEnds& q) {
  using Z = exact::Integer<limbs>;
  if (exact::boxes_apart(kind, q.t0, q.t1, 0)) return {true, {}};
  const exact::GivenMotion given(q.t0, q.t1);
  if (given.bits > exact::Widths<Z>::coordinate_bits) return {false, {}};
  return exact::earliest(given.query<Z>(kind));
}

// A result as one number: the time of a contact, or one of these. Any other value means an undecided pair. Memory is
// initialised with such a value when it is allocated (test_lists.cuh), and by the kernel that collects results, which
// is cheaper than a memset per frame.
inline constexpr double no_contact = 2, stays_open = 3;
__device__ inline double awaited() { return __longlong_as_double(-1); }  // NaN

template <int limbs, class T>
__global__ __launch_bounds__(128) void integers_kernel(const __grid_constant__ LaunchParams<T> params,
                                                       u32 resident_warps) {
  const u64 n = length(params.counters->open_in_integers[limbs - 1], params.open_capacity);
  const u64 i = item_of_thread(n, resident_warps);
  if (i >= n) return;
  const Candidate pair = params.keys.pair_of(params.open_in_integers[limbs - 1][i]);
  const exact::Answer answer =
      decide_in_integers<limbs>(pair.kind, load_pair_ends(params.vertices, vertices_of(params, pair)));
  params.answers[i] = !answer.decided ? stays_open : answer.toc ? *answer.toc : no_contact;
}

template <int limbs, class T>
__global__ __launch_bounds__(128) void collect_answers_kernel(const __grid_constant__ LaunchParams<T> params) {
  Counters& c = *params.counters;
  const u64 n = length(c.open_in_integers[limbs - 1], params.open_capacity),
            stride = static_cast<u64>(gridDim.x) * blockDim.x;
  for (u64 i = static_cast<u64>(blockIdx.x) * blockDim.x + threadIdx.x; i - lane_number() < n; i += stride) {
    const bool valid = i < n;
    const u64 key = valid ? params.open_in_integers[limbs - 1][i] : 0;
    const double answer = valid ? params.answers[i] : no_contact;
    if (valid) params.answers[i] = awaited();  // read by the next stage
    const bool contact = answer <= 1, open = !contact && answer != no_contact;
    const Candidate pair = params.keys.pair_of(key);
    append_found(params, pair.kind, contact, {pair.first, pair.second}, answer);
    count_lanes(c.found, contact, pair.kind);
    count_lanes(c.by_integers, valid && !open, pair.kind);
    if (params.time_only) keep_soonest(&c.soonest, contact ? answer : INFINITY);
    if constexpr (limbs < integer_sizes)
      append_key(params.open_in_integers[limbs], params.open_capacity, &c.open_in_integers[limbs], open, key);
    else
      append_key(params.to_host, params.to_host_capacity, &c.to_host, open, key);
  }
}

template <int limbs, class T>
void launch_integers_of(const LaunchParams<T>& params, const Stages& stages) {
  stages.one_item_each(integers_kernel<limbs, T>, 128, params.open_capacity, "integers_kernel", params);
  stages.persistent(collect_answers_kernel<limbs, T>, 128, params, "collect_answers_kernel");
}

}  // namespace

template <class T>
void launch_integers(const LaunchParams<T>& params, const Stages& stages) {
  static_assert(integer_sizes == 2);
  launch_integers_of<1>(params, stages);
  launch_integers_of<2>(params, stages);
  stages.mark("integers");
}

template void launch_integers(const LaunchParams<float>&, const Stages&);
template void launch_integers(const LaunchParams<double>&, const Stages&);

}  // namespace hpccd::gpu
