// SPDX-License-Identifier: Apache-2.0
#include "gpu/integers.cuh"
#include "gpu/stages.cuh"

namespace hpccd::gpu {

template <class T>
void launch_integers(const LaunchParams<T>& params, const Stages& stages) {
  static_assert(integer_sizes == 2);
  stages.persistent(integers_kernel<1, T>, 32, params, "integers_kernel<1>");
  stages.persistent(integers_kernel<2, T>, 32, params, "integers_kernel<2>");
  stages.mark("integers");
}

template void launch_integers(const LaunchParams<float>&, const Stages&);
template void launch_integers(const LaunchParams<double>&, const Stages&);

}  // namespace hpccd::gpu
