// SPDX-License-Identifier: Apache-2.0
#include "gpu/points.cuh"

namespace hpccd::gpu {

template <class T>
void launch_winding_numbers(const LaunchParams<T>& params, const PointsTask& task, const Stages& stages) {
  winding_kernel<<<blocks_for(task.n, 128), 128, 0, stages.stream>>>(params, task);
  check_launch("winding_kernel");
  stages.mark("winding_numbers");
}

template void launch_winding_numbers(const LaunchParams<float>&, const PointsTask&, const Stages&);
template void launch_winding_numbers(const LaunchParams<double>&, const PointsTask&, const Stages&);

}  // namespace hpccd::gpu
