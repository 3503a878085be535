// SPDX-License-Identifier: Apache-2.0
#include <map>
#include <mutex>

#include "gpu/candidates.cuh"
#include "gpu/elementary.cuh"
#include "gpu/test_lists.cuh"

namespace hpccd::gpu {
namespace {

// Blocks of a kernel that fit on one multiprocessor of the current device.
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

// As many blocks as fit take work until there is none.
template <class Kernel, class T>
void persistent(Kernel kernel, unsigned threads, const LaunchParams<T>& params, int multiprocessors,
                cudaStream_t stream, const char* name) {
  const int blocks = blocks_that_fit(reinterpret_cast<const void*>(kernel), threads, name);
  kernel<<<static_cast<unsigned>(blocks * multiprocessors), threads, 0, stream>>>(params);
  check_launch(name);
}

}  // namespace

template <class T>
void TestLists::launch(LaunchParams<T>& params, int multiprocessors, cudaStream_t stream, StageTimer& timer) {
  const auto list = [](const DeviceBuffer<uint2>& b) { return PairList{b.data(), b.size()}; };
  for (int k = 0; k < 2; ++k)
    params.survivors[k] = list(survivors_[k]), params.single[k] = list(single_[k]), params.many[k] = list(many_[k]);
  params.undecided = undecided_.data(), params.undecided_capacity = undecided_.size();
  params.to_host = to_host_.data(), params.to_host_capacity = to_host_.size();
  params.n_segments = n_segments_;
  const auto run = [&](auto kernel, unsigned threads, const char* name) {
    persistent(kernel, threads, params, multiprocessors, stream, name);
  };
  for (params.segment = 0; params.segment < n_segments_; ++params.segment) {
    run(candidates_kernel<T>, 32 * candidate_warps, "candidates_kernel");
    timer.mark("candidates", stream);
    run(projection_kernel<Kind::vertex_face, T>, 128, "projection_kernel");
    run(projection_kernel<Kind::edge_edge, T>, 128, "projection_kernel");
    timer.mark("projection", stream);
    run(roots_kernel<Kind::vertex_face, true, T>, 128, "roots_kernel");
    run(roots_kernel<Kind::edge_edge, true, T>, 128, "roots_kernel");
    timer.mark("single_root", stream);
    run(roots_kernel<Kind::vertex_face, false, T>, 128, "roots_kernel");
    run(roots_kernel<Kind::edge_edge, false, T>, 128, "roots_kernel");
    timer.mark("many_roots", stream);
    end_segment_kernel<<<1, 1, 0, stream>>>(params);
    check_launch("end_segment_kernel");
  }
  fallback_kernel<<<static_cast<unsigned>(2 * multiprocessors), 32, 0, stream>>>(params);
  check_launch("fallback_kernel");
  timer.mark("last_resort", stream);  // the fallbacks' first name, under which kept results have it
}

template void TestLists::launch(LaunchParams<float>&, int, cudaStream_t, StageTimer&);
template void TestLists::launch(LaunchParams<double>&, int, cudaStream_t, StageTimer&);

}  // namespace hpccd::gpu
