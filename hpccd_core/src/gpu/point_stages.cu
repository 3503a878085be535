// SPDX-License-Identifier: Apache-2.0
#include "gpu/points.cuh"

namespace hpccd::gpu {

template <class T>
void launch_points(const LaunchParams<T>& params, const PointsTask& task, const Stages& stages) {
  constexpr unsigned threads = 128;
  winding_kernel<<<blocks_for(task.n, threads), threads, 0, stages.stream>>>(params, task);
  check_launch("winding_kernel");
  stages.mark("winding_numbers");
  if (!task.with_distances) return;
  check(cudaMemsetAsync(task.extent, 0, sizeof *task.extent, stages.stream), "cudaMemsetAsync");
  mesh_extent_kernel<<<std::min(blocks_for(params.n_vertices, 256), static_cast<unsigned>(stages.multiprocessors)), 256,
                       0, stages.stream>>>(params, task);
  check_launch("mesh_extent_kernel");
  nearest_kernel<<<blocks_for(task.n, threads), threads, 0, stages.stream>>>(params, task);
  check_launch("nearest_kernel");
  stages.mark("nearest_faces");
}

template void launch_points(const LaunchParams<float>&, const PointsTask&, const Stages&);
template void launch_points(const LaunchParams<double>&, const PointsTask&, const Stages&);

}  // namespace hpccd::gpu
