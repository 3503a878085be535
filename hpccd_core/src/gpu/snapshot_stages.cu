// SPDX-License-Identifier: Apache-2.0
#include "gpu/candidates.cuh"
#include "gpu/near_candidates.cuh"
#include "gpu/snapshot.cuh"
#include "gpu/stages.cuh"

namespace hpccd::gpu {

template <class T>
void launch_snapshot(Query query, const LaunchParams<T>& params, const Stages& stages) {
  constexpr unsigned threads = 32 * candidate_warps;
  if (query == Query::proximity) {
    stages.persistent(params.filtered ? near_candidates_kernel<true, T> : near_candidates_kernel<false, T>, threads,
                      params, "near_candidates_kernel");
    stages.mark("candidates");
    stages.persistent(proximity_kernel<T>, proximity_threads, params, "proximity_kernel", 2);
    stages.mark("proximity");
  } else {
    stages.persistent(params.filtered ? candidates_kernel<Query::intersections, true, T>
                                      : candidates_kernel<Query::intersections, false, T>,
                      threads, params, "candidates_kernel");
    stages.mark("candidates");
    stages.persistent(intersection_kernel<T>, 128, params, "intersection_kernel");
    stages.mark("intersections");
  }
}

template void launch_snapshot(Query, const LaunchParams<float>&, const Stages&);
template void launch_snapshot(Query, const LaunchParams<double>&, const Stages&);

}  // namespace hpccd::gpu
