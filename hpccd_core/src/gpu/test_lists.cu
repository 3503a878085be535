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
void persistent(Kernel kernel, unsigned threads, const Frame<T>& f, int multiprocessors, cudaStream_t stream,
                const char* name) {
  const int blocks = blocks_that_fit(reinterpret_cast<const void*>(kernel), threads, name);
  kernel<<<static_cast<unsigned>(blocks * multiprocessors), threads, 0, stream>>>(f);
  check_launch(name);
}

}  // namespace

template <class T>
void TestLists::launch(Frame<T>& f, int multiprocessors, cudaStream_t stream, StageTimer& timer) {
  const auto list = [](const DeviceBuffer<uint2>& b) { return PairList{b.data(), b.size()}; };
  for (int k = 0; k < 2; ++k)
    f.survivors[k] = list(survivors_[k]), f.single[k] = list(single_[k]), f.many[k] = list(many_[k]);
  f.undecided = undecided_.data(), f.undecided_capacity = undecided_.size();
  f.to_host = to_host_.data(), f.to_host_capacity = to_host_.size();
  f.n_segments = n_segments_;
  const auto run = [&](auto kernel, unsigned threads, const char* name) {
    persistent(kernel, threads, f, multiprocessors, stream, name);
  };
  for (f.segment = 0; f.segment < n_segments_; ++f.segment) {
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
    end_segment_kernel<<<1, 1, 0, stream>>>(f);
    check_launch("end_segment_kernel");
  }
  fallback_kernel<<<static_cast<unsigned>(2 * multiprocessors), 32, 0, stream>>>(f);
  check_launch("fallback_kernel");
  timer.mark("last_resort", stream);
}

template void TestLists::launch(Frame<float>&, int, cudaStream_t, StageTimer&);
template void TestLists::launch(Frame<double>&, int, cudaStream_t, StageTimer&);

}  // namespace hpccd::gpu
