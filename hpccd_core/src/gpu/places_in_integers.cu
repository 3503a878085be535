// SPDX-License-Identifier: Apache-2.0
// Normals of rows that doubles leave undecided, in the CPU's integers of one and two limbs.
#include "gpu/item_of_thread.cuh"
#include "gpu/pair_lists.cuh"
#include "gpu/write_places.cuh"

namespace hpccd::gpu {
namespace {

// Replaces the number of a row that has been written.
constexpr u64 written = ~u64{0};

__global__ __launch_bounds__(128) void places_in_integers_kernel(const __grid_constant__ PlacesTask task,
                                                                 u32 resident_warps) {
  const u64 n = length(task.n_open[0], task.open_capacity), i = item_of_thread(n, resident_warps);
  if (i < n && find_places<ByFixedIntegers>(task, task.open[i])) task.open[i].row = written;
}

__global__ void collect_open_rows_kernel(const __grid_constant__ PlacesTask task) {
  const u64 n = length(task.n_open[0], task.open_capacity), stride = static_cast<u64>(gridDim.x) * blockDim.x;
  for (u64 i = static_cast<u64>(blockIdx.x) * blockDim.x + threadIdx.x; i - lane_number() < n; i += stride) {
    const bool open = i < n && task.open[i].row != written;
    const u64 at = warp_append(task.n_open + 1, open);
    if (open) task.to_host[at] = task.open[i];
  }
}

}  // namespace

void launch_places_in_integers(const PlacesTask& task, const Stages& stages) {
  if (task.out.outputs.normals || task.out.outputs.weights)
    stages.one_item_each(places_in_integers_kernel, 128, task.open_capacity, "places_in_integers_kernel", task);
  collect_open_rows_kernel<<<static_cast<unsigned>(stages.multiprocessors), 256, 0, stages.stream>>>(task);
  check_launch("collect_open_rows_kernel");
  stages.mark("places");
}

}  // namespace hpccd::gpu
