// SPDX-License-Identifier: Apache-2.0
// Device memory of one element of the GPU task queue, and its output buffer in page-locked memory. Kernels write
// directly to the buffer: nothing has to be copied back.
#pragma once

#include <algorithm>
#include <atomic>
#include <vector>

#include "gpu/device_scene.cuh"
#include "gpu/test_lists.cuh"
#include "hybrid/test_device.h"

namespace hpccd::hybrid {

using namespace gpu;  // included by device code only

static_assert(sizeof(LeafPair) == sizeof(uint2));

// Values that differ between submissions of one slot; in page-locked memory, which the device reads.
struct Submission {
  u64 leaf_pairs;
  u32 number;
};

static __global__ void begin_submission_kernel(Counters* counters, const Submission* submission) {
  constexpr u32 words = sizeof(Counters) / sizeof(u64);
  static_assert(sizeof(Counters) % sizeof(u64) == 0);
  for (u32 i = threadIdx.x; i < words; i += blockDim.x) reinterpret_cast<u64*>(counters)[i] = 0;
  __syncthreads();
  if (threadIdx.x == 0) counters->leaf_pairs = submission->leaf_pairs;
}

// Sets the state variable of an element of the GPU task queue to "data ready", after all data that it announces.
static __global__ void data_ready_kernel(const Counters* counters, Counters* to_host, u32* state,
                                         const Submission* submission) {
  *to_host = *counters;
  __threadfence_system();
  *reinterpret_cast<volatile u32*>(state) = submission->number;
}

// The sizes to which a slot's lists have grown: the other slots need them too.
struct LargestLists {
  TestLists::Sizes lists{};
  std::size_t found = 0;
};

class Slot {
 public:
  // Initial sizes: lists grow when they overflow, and other slots begin with the sizes of this one.
  Slot() : lists_(std::size_t{1} << 17, std::size_t{1} << 15, std::size_t{1} << 12) {
    counters_.reserve(1);
    host_counters_.reserve(1);
    state_.reserve(1);
    submission_.reserve(1);
    *state_.data() = 0;
    *submission_.data() = {0, 0};
    reserve_found(std::size_t{1} << 13);
  }

  bool busy = false;

  // The pairs of the next launches.
  void assign(const std::vector<Piece>& pieces) { sent_ = pieces; }

  // Tests them after the event. `params` refers to the frame's scene, leaves and motion, at the same addresses as in
  // the last launch if `version` is the same.
  template <class T>
  void launch(const DeviceScene& scene, LaunchParams<T> params, std::uint64_t version, const LargestLists& largest,
              cudaEvent_t after, int multiprocessors) {
    lists_.reserve(largest.lists);
    reserve_found(largest.found);
    std::size_t n = 0;
    for (const Piece& piece : sent_) n += piece.n;
    if (n > pairs_.size()) pairs_.reserve(2 * n);
    *submission_.data() = {n, submission_.data()->number + 1};
    looks_ = 0;
    record(scene, params, version, multiprocessors);
    check(cudaStreamWaitEvent(stream_, after, 0), "cudaStreamWaitEvent");
    std::size_t at = 0;
    for (const Piece& piece : sent_) {
      check(cudaMemcpyAsync(pairs_.data() + at, piece.pairs, piece.n * sizeof(uint2), cudaMemcpyHostToDevice, stream_),
            "cudaMemcpyAsync");
      at += piece.n;
    }
    graph_.launch(stream_);
  }

  bool data_ready() {
    if (std::atomic_ref<u32>(*state_.data()).load(std::memory_order_acquire) == submission_.data()->number) return true;
    // A failed kernel does not report it: its stream does. Querying the stream costs more than reading the state.
    if (++looks_ % 1024 == 0)
      if (const cudaError_t e = cudaStreamQuery(stream_); e != cudaErrorNotReady) check(e, "cudaStreamQuery");
    return false;
  }

  // When data is ready: enlarges lists that were too short. True if the pairs must be tested again.
  bool grow(LargestLists& largest) {
    const Counters& c = *host_counters_.data();
    bool again = lists_.grow(c, TestLists::From::leaves);
    if (c.found_all > found_capacity_) {
      again = true;
      reserve_found(c.found_all + c.found_all / 4);
    }
    if (again) {
      largest.lists.include(lists_.sizes());
      largest.found = std::max(largest.found, found_capacity_);
    }
    return again;
  }

  void append_to(Output& output, const DeviceScene& scene) const {
    const Counters& c = *host_counters_.data();
    gpu::require_balance(c, false);
    // All or nothing: on a failure here the CPU tests the pairs again.
    const auto make_room = [](auto& list, std::size_t more) {
      // At least doubles the capacity: with many segments, each would otherwise copy all previous ones.
      if (const std::size_t n = list.size() + more; n > list.capacity()) list.reserve(std::max(n, 2 * list.capacity()));
    };
    make_room(output.vertex_face, c.found[0]);
    make_room(output.edge_edge, c.found[1]);
    make_room(output.undecided, c.to_host);
    for (u64 i = 0; i < c.found_all; ++i) {
      const Candidate p = scene.keys().pair_of(keys_.data()[i]);
      auto& list = p.kind == Kind::vertex_face ? output.vertex_face : output.edge_edge;
      list.push_back({p.first, p.second, tocs_.data()[i]});
    }
    for (u64 i = 0; i < c.to_host; ++i) output.undecided.push_back(scene.keys().pair_of(lists_.to_host()[i]));
    for (int k = 0; k < 2; ++k) output.counts[k] += batch_counts(c, k), output.ignored[k] += c.ignored[k];
  }

  // Waits for all running work, whether or not it succeeds.
  void drain() {
    cudaStreamSynchronize(stream_);
    busy = false;
  }

  std::size_t bytes() const { return lists_.bytes() + pairs_.bytes(); }

 private:
  void reserve_found(std::size_t n) {
    if (n <= found_capacity_) return;
    found_capacity_ = 0;  // if one of these fails, the others have changed
    keys_.reserve(n);
    tocs_.reserve(n);
    found_capacity_ = n;
  }

  // The kernels between the copy and "data ready", recorded again if something that they refer to has changed.
  template <class T>
  void record(const DeviceScene& scene, LaunchParams<T> params, std::uint64_t version, int multiprocessors) {
    // Addresses as well as sizes: after a failed allocation a buffer may have the same size at another address.
    std::vector<std::uintptr_t> now{sizeof(T), version, lists_.n_segments(), scene.separations_version()};
    const auto depends_on = [&](const auto& buffer) {
      now.push_back(reinterpret_cast<std::uintptr_t>(buffer.data()));
      now.push_back(buffer.size());
    };
    depends_on(pairs_), depends_on(keys_), depends_on(tocs_);
    now.push_back(found_capacity_);
    lists_.for_buffers(depends_on);
    if (now == recorded_) return;
    recorded_.clear();
    params.counters = counters_.data();
    params.leaf_pairs = {pairs_.data(), pairs_.size()};
    params.found_keys = keys_.data(), params.found_tocs = tocs_.data(), params.found_capacity = found_capacity_;
    StageTimer no_timer(false);
    graph_.record(stream_, [&] {
      begin_submission_kernel<<<1, 32, 0, stream_>>>(params.counters, submission_.data());
      check_launch("begin_submission_kernel");
      lists_.launch(scene.query_now(), TestLists::From::leaves, params, multiprocessors, stream_, no_timer);
      data_ready_kernel<<<1, 1, 0, stream_>>>(params.counters, host_counters_.data(), state_.data(),
                                              submission_.data());
      check_launch("data_ready_kernel");
    });
    recorded_ = now;
  }

  Stream stream_;
  TestLists lists_;
  DeviceBuffer<uint2> pairs_;
  DeviceBuffer<Counters> counters_;
  PinnedBuffer<Counters> host_counters_;
  std::size_t found_capacity_ = 0;  // of both that follow
  PinnedBuffer<u64> keys_;
  PinnedBuffer<double> tocs_;
  PinnedBuffer<u32> state_;
  PinnedBuffer<Submission> submission_;  // its number is the state when data is ready
  Graph graph_;
  std::vector<std::uintptr_t> recorded_;  // the values on which the graph depends, when it was recorded
  std::vector<Piece> sent_;
  u32 looks_ = 0;
};

}  // namespace hpccd::hybrid
