// SPDX-License-Identifier: Apache-2.0
#include "gpu/hints.cuh"
#include "gpu/stages.cuh"

namespace hpccd::gpu {
namespace {

template <Query query, class T>
void launch(const LaunchParams<T>& params, const Stages& stages) {
  constexpr unsigned threads = 32;  // the fallback of some pairs needs most of the registers
  constexpr auto blocks = static_cast<unsigned>(Hints::most / threads);
  hints_kernel<query, T><<<dim3(blocks, 2), threads, 0, stages.stream>>>(params);
  check_launch("hints_kernel");
  stages.mark("hints");
}

}  // namespace

template <class T>
void launch_hints(Query query, const LaunchParams<T>& params, const Stages& stages) {
  if (query == Query::separations)
    launch<Query::separations>(params, stages);
  else
    launch<Query::contacts>(params, stages);
}

template void launch_hints(Query, const LaunchParams<float>&, const Stages&);
template void launch_hints(Query, const LaunchParams<double>&, const Stages&);

}  // namespace hpccd::gpu
