// SPDX-License-Identifier: Apache-2.0
#include "gpu/candidates.cuh"
#include "gpu/separation.cuh"
#include "gpu/stages.cuh"

namespace hpccd::gpu {

template <class T>
void launch_separation_candidates(const LaunchParams<T>& params, const Stages& stages) {
  stages.persistent(candidates_kernel<Query::separations, T>, 32 * candidate_warps, params, "candidates_kernel");
  stages.mark("candidates");
}

template <class T>
void launch_separations(const LaunchParams<T>& params, const Stages& stages) {
  stages.persistent(separation_filter_kernel<Kind::vertex_face, T>, 128, params, "separation_filter_kernel");
  stages.persistent(separation_filter_kernel<Kind::edge_edge, T>, 128, params, "separation_filter_kernel");
  stages.mark("separation_filter");
  stages.persistent(separation_kernel<Kind::vertex_face, T>, 128, params, "separation_kernel");
  stages.persistent(separation_kernel<Kind::edge_edge, T>, 128, params, "separation_kernel");
  stages.mark("separation");
}

template void launch_separation_candidates(const LaunchParams<float>&, const Stages&);
template void launch_separation_candidates(const LaunchParams<double>&, const Stages&);
template void launch_separations(const LaunchParams<float>&, const Stages&);
template void launch_separations(const LaunchParams<double>&, const Stages&);

}  // namespace hpccd::gpu
