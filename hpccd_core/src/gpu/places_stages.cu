// SPDX-License-Identifier: Apache-2.0
#include "gpu/places.cuh"
#include "gpu/stages.cuh"

namespace hpccd::gpu {

template <class T>
void launch_places(const LaunchParams<T>& params, const PlacesTask& task, const Stages& stages) {
  constexpr unsigned threads = 128;
  const auto kernel = places_kernel<T>;
  const int blocks = blocks_that_fit(reinterpret_cast<const void*>(kernel), threads, "places_kernel");
  kernel<<<static_cast<unsigned>(blocks * stages.multiprocessors), threads, 0, stages.stream>>>(params, task);
  check_launch("places_kernel");
  stages.mark("places");
}

template void launch_places(const LaunchParams<float>&, const PlacesTask&, const Stages&);
template void launch_places(const LaunchParams<double>&, const PlacesTask&, const Stages&);

}  // namespace hpccd::gpu
