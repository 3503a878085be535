// SPDX-License-Identifier: Apache-2.0
// Frames that involve no host: their counts and state.
#pragma once

#include "gpu/ordering.cuh"
#include "gpu/places_task.cuh"
#include "hpccd/prepared.h"

namespace hpccd::gpu {

// The sizes of the lists of such a frame.
struct PreparedRoom {
  u64 leaf_pairs, survivors, single, many, separated, undecided, open, found;
};

// No rows; a reader of the worlds' offsets must not find any either. k: number of the thread.
__device__ inline void withdraw(const ResultPlaces& to, u32 n_worlds, PreparedCounts* told, u32 k) {
  if (n_worlds > 1 && k <= n_worlds) {
    to.vf_offsets[k] = to.ee_offsets[k] = 0;
    if (k < n_worlds) to.hashes[k] = 0, to.first_tocs[k] = INFINITY;
  }
  if (k == 0) told->vertex_face = told->edge_edge = told->hash = 0, told->first_toc = INFINITY;
}

// Runs after all other work of the frame, except outputs.
template <class T>
__global__ void tell_kernel(const __grid_constant__ LaunchParams<T> params, const __grid_constant__ PreparedRoom room,
                            const __grid_constant__ ResultPlaces to, PreparedCounts* told) {
  const Counters& c = *params.counters;
  const bool too_long = c.leaf_pairs > room.leaf_pairs || c.most_survivors > room.survivors ||
                        c.most_single > room.single || c.most_many > room.many || c.most_separated > room.separated ||
                        c.undecided > room.undecided || c.open_in_integers[0] > room.open || c.found_all > room.found ||
                        !fit<false>(c, to);
  const bool left = c.to_host || (!too_long && !books_balance(c, false));
  const u64 state = (too_long ? PreparedCounts::no_room : 0) | (left ? PreparedCounts::left_to_cpu : 0) |
                    (c.bad ? PreparedCounts::bad_coordinates : 0) |
                    (c.most_of_a_feature > most_of_a_feature ? PreparedCounts::too_many_of_one : 0);
  const bool good = state == PreparedCounts::complete;
  const u32 k = blockIdx.x * blockDim.x + threadIdx.x;
  if (k == 0) told->state = state;
  if (!good) return withdraw(to, params.n_worlds, told, k);
  if (k > 0) return;
  told->vertex_face = c.rows[0], told->edge_edge = c.rows[1], told->hash = c.world.hash;
  const u64 soonest = c.world.first_toc;
  told->first_toc = soonest ? __longlong_as_double(static_cast<long long>(~soonest)) : INFINITY;
}

// After the outputs: without those of some rows, the frame is not complete.
__global__ void tell_places_kernel(const __grid_constant__ PlacesTask task, u32 n_worlds,
                                   const __grid_constant__ ResultPlaces to, PreparedCounts* told) {
  if (task.n_open[0] <= task.open_capacity && task.n_open[1] == 0) return;
  const u32 k = blockIdx.x * blockDim.x + threadIdx.x;
  if (k == 0)
    told->state |= task.n_open[0] > task.open_capacity ? PreparedCounts::no_room : PreparedCounts::left_to_cpu;
  withdraw(to, n_worlds, told, k);
}

}  // namespace hpccd::gpu
