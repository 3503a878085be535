// SPDX-License-Identifier: Apache-2.0
#include "gpu/nearest_inside.cuh"
#include "gpu/nearest_search.cuh"

namespace hpccd::gpu {

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
