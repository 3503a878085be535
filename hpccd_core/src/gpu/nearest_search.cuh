// SPDX-License-Identifier: Apache-2.0
// Launches a search for the nearest features (nearest_launch.cuh).
#pragma once

#include "gpu/nearest_launch.cuh"
#include "gpu/nearest_leaves.cuh"

namespace hpccd::gpu {

// After the bounds by the last call's pairs. Nothing for positions: they rarely jump.
template <class T>
void launch_descent(const LaunchParams<T>&, const NearestTask&, const Stages&) {}

template <class T>
void launch_nearest(const LaunchParams<T>& params, const NearestTask& task, u32 levels, bool within_meshes,
                    const Stages& stages) {
  constexpr unsigned threads = 128;
  check(cudaMemsetAsync(task.counters, 0, sizeof *task.counters, stages.stream), "cudaMemsetAsync");
  begin_nearest_kernel<<<blocks_for(task.n_all, threads), threads, 0, stages.stream>>>(params, task);
  check_launch("begin_nearest_kernel");
  launch_descent(params, task, stages);
  const int fit =
      blocks_that_fit(reinterpret_cast<const void*>(nearest_leaves_kernel<T>), 32 * nearest_warps, "nearest_leaves");
  const unsigned blocks = static_cast<unsigned>(fit * stages.multiprocessors);
  const auto search_leaves = [&](bool samples) {
    nearest_leaves_kernel<<<blocks, 32 * nearest_warps, 0, stages.stream>>>(params, task, samples);
    check_launch("nearest_leaves_kernel");
  };
  if (within_meshes) search_leaves(true);
  stages.mark("bounds_of_pairs");
  for (u32 level = 0; level < levels; ++level) {
    nearest_nodes_kernel<<<static_cast<unsigned>(4 * stages.multiprocessors), threads, 0, stages.stream>>>(params, task,
                                                                                                           level);
    check_launch("nearest_nodes_kernel");
  }
  stages.mark("traverse");
  search_leaves(false);
  stages.mark("nearest");
  nearest_results_kernel<<<blocks_for(task.n_all, threads), threads, 0, stages.stream>>>(params, task);
  check_launch("nearest_results_kernel");
}

}  // namespace hpccd::gpu
