// SPDX-License-Identifier: Apache-2.0
#include "gpu/nearest_inside.cuh"
#include "gpu/nearest_launch.cuh"
#include "gpu/nearest_leaves.cuh"

namespace hpccd::gpu {

template <class T>
void launch_nearest(const LaunchParams<T>& params, const NearestTask& task, u32 levels, bool within_meshes,
                    const Stages& stages) {
  constexpr unsigned threads = 128;
  check(cudaMemsetAsync(task.counters, 0, sizeof *task.counters, stages.stream), "cudaMemsetAsync");
  begin_nearest_kernel<<<blocks_for(task.n_all, threads), threads, 0, stages.stream>>>(params, task);
  check_launch("begin_nearest_kernel");
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

template <class T>
void launch_inside(const LaunchParams<T>& params, const InsideTask& task, const Stages& stages) {
  inside_kernel<<<blocks_for(task.n, inside_warps), 32 * inside_warps, 0, stages.stream>>>(params, task);
  check_launch("inside_kernel");
  stages.mark("containment");
}

template void launch_inside(const LaunchParams<float>&, const InsideTask&, const Stages&);
template void launch_inside(const LaunchParams<double>&, const InsideTask&, const Stages&);
template void launch_nearest(const LaunchParams<float>&, const NearestTask&, u32, bool, const Stages&);
template void launch_nearest(const LaunchParams<double>&, const NearestTask&, u32, bool, const Stages&);

}  // namespace hpccd::gpu
