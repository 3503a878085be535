// SPDX-License-Identifier: Apache-2.0
#include "gpu/integers.cuh"
#include "gpu/stages.cuh"

namespace hpccd::gpu {

namespace {

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
