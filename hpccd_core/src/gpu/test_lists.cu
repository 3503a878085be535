// SPDX-License-Identifier: Apache-2.0
#include <map>
#include <mutex>

#include "gpu/contact_candidates.cuh"
#include "gpu/roots.cuh"
#include "gpu/stages.cuh"
#include "gpu/test_lists.cuh"

namespace hpccd::gpu {

int blocks_that_fit(const void* kernel, unsigned threads, const char* name) {
  static std::mutex mutex;
  static std::map<std::pair<const void*, int>, int> known;
  int device = 0;
  check(cudaGetDevice(&device), "cudaGetDevice");
  std::lock_guard lock(mutex);
  int& blocks = known[{kernel, device}];
  if (blocks == 0)
    check(cudaOccupancyMaxActiveBlocksPerMultiprocessor(&blocks, kernel, static_cast<int>(threads), 0), name);
  return std::max(blocks, 1);
}

namespace {

template <class T>
void launch_root_tests(const LaunchParams<T>& params, const Stages& stages) {
  stages.persistent(roots_kernel<true, T>, 128, params, "roots_kernel", 2);
  stages.mark("single_root");
  stages.persistent(roots_kernel<false, T>, 128, params, "roots_kernel", 2);
  stages.mark("many_roots");
}

template <class T>
void launch_contact_candidates(const LaunchParams<T>& params, const Stages& stages) {
  stages.persistent(
      params.filtered ? contact_candidates_kernel<Sieve, true, T> : contact_candidates_kernel<Sieve, false, T>,
      32 * candidate_warps, params, "contact_candidates_kernel");
  stages.mark("candidates");
}

template <class T>
void launch_sieve(const LaunchParams<T>& params, const Stages& stages) {
  stages.persistent(sort_survivors_kernel<Sieve, T>, 128, params, "sort_survivors_kernel", 2);
  stages.mark("sort_survivors");
}

}  // namespace

template <class T>
void TestLists::launch(Query query, From from, LaunchParams<T>& params, int multiprocessors, cudaStream_t stream,
                       StageTimer& timer) {
  fill(params);
  params.n_segments = from == From::leaves ? n_segments_ : 1;
  const Stages stages{multiprocessors, stream, timer};
  const auto end_segment = [&] {
    end_segment_kernel<<<1, 1, 0, stream>>>(params);
    check_launch("end_segment_kernel");
  };
  for (params.segment = 0; params.segment < params.n_segments; ++params.segment) {
    const bool leaves = from == From::leaves;
    if (params.in_floats) {
      launch_likely(params, stages);
      end_segment();
      if (!params.in_doubles) continue;
    }
    if (query == Query::contacts) {
      if (leaves) launch_contact_candidates(params, stages);
      launch_sieve(params, stages);
    } else if (query == Query::separations) {
      if (leaves) launch_separation_candidates(params, stages);
      launch_separations(params, stages);
    } else {
      launch_snapshot(query, params, stages);
    }
    if (!of_snapshot(query)) launch_root_tests(params, stages);
    end_segment();
  }
  if (of_snapshot(query)) return;
  if (params.time_only || params.until_best) {
    soonest_kernel<<<static_cast<unsigned>(multiprocessors), 256, 0, stream>>>(params);
    check_launch("soonest_kernel");
    timer.mark("earliest", stream);
  }
  stages.persistent(query == Query::separations ? fallback_kernel<true, T> : fallback_kernel<false, T>, 32, params,
                    "fallback_kernel");
  timer.mark("fallbacks", stream);
  if (params.integers_on_device) launch_integers(params, stages);
}

template void TestLists::launch(Query, From, LaunchParams<float>&, int, cudaStream_t, StageTimer&);
template void TestLists::launch(Query, From, LaunchParams<double>&, int, cudaStream_t, StageTimer&);

}  // namespace hpccd::gpu
