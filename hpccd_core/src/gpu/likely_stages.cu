// SPDX-License-Identifier: Apache-2.0
#include "gpu/contact_candidates.cuh"
#include "gpu/likely.cuh"
#include "gpu/stages.cuh"

namespace hpccd::gpu {

template <class T>
void launch_likely(const LaunchParams<T>& params, const Stages& stages) {
  stages.persistent(
      params.filtered ? contact_candidates_kernel<Likely, true, T> : contact_candidates_kernel<Likely, false, T>,
      32 * candidate_warps, params, "contact_candidates_kernel");
  stages.mark("candidates");
  stages.persistent(sort_survivors_kernel<Likely, T>, 128, params, "sort_survivors_kernel", 2);
  stages.mark("sort_survivors");
  stages.persistent(likely_roots_kernel<T>, 128, params, "likely_roots_kernel", 4);
  stages.mark("likely_roots");
  stages.persistent(open_pairs_kernel<T>, 128, params, "open_pairs_kernel", 2);
  stages.mark("open_pairs");
}

template void launch_likely(const LaunchParams<float>&, const Stages&);
template void launch_likely(const LaunchParams<double>&, const Stages&);

}  // namespace hpccd::gpu
