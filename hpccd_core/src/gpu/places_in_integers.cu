// SPDX-License-Identifier: Apache-2.0
// Normals of the rows that doubles are not sure of, in the CPU's integers of one and two limbs.
#include "gpu/pair_lists.cuh"
#include "gpu/write_places.cuh"

namespace hpccd::gpu {
namespace {

// A thread a row, spread over warps, which go the ways of all their rows.
__global__ __launch_bounds__(32) void places_in_integers_kernel(const __grid_constant__ PlacesTask task) {
  const u64 n = length(task.n_open[0], task.open_capacity), n_warps = gridDim.x;
  for (u64 begin = 0; begin < n; begin += 32 * n_warps) {
    const u64 i = begin + lane_number() * n_warps + blockIdx.x;
    const bool open = i < n && !find_places<ByFixedIntegers>(task, task.open[i]);
    const u64 at = warp_append(task.n_open + 1, open);
    if (open) task.to_host[at] = task.open[i];
  }
}

}  // namespace

void launch_places_in_integers(const PlacesTask& task, const Stages& stages) {
  constexpr unsigned threads = 32;
  const int blocks =
      blocks_that_fit(reinterpret_cast<const void*>(places_in_integers_kernel), threads, "places_in_integers_kernel");
  places_in_integers_kernel<<<static_cast<unsigned>(blocks * stages.multiprocessors), threads, 0, stages.stream>>>(
      task);
  check_launch("places_in_integers_kernel");
  stages.mark("places");
}

}  // namespace hpccd::gpu
