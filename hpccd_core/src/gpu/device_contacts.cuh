// SPDX-License-Identifier: Apache-2.0
// The contacts of a frame: as the kernels find them, sorted, and as the caller sees them in page-locked memory.
#pragma once

#include <algorithm>
#include <array>

#include "gpu/pipeline.h"
#include "gpu/results.cuh"
#include "gpu/sort.h"
#include "gpu/stream.h"

namespace hpccd::gpu {

class DeviceContacts {
 public:
  explicit DeviceContacts(u32 key_bits) : key_bits_(static_cast<int>(key_bits)) {}

  // Room for n to be found.
  void reserve(std::size_t n, cudaStream_t stream) {
    if (n <= capacity_) return;
    if (n > 0x7FFFFFFF) throw Error("more than 2^31 contacts; use backend=\"cpu\"");
    capacity_ = 0;  // should one of these fail, the others have changed
    keys_.reserve(n);
    tocs_.reserve(n);
    sorted_keys_.reserve(n);
    numbers_.reserve(n);
    workspace_.reserve(sort_workspace(static_cast<int>(n), key_bits_));
    number_kernel<<<blocks_for(n, 256), 256, 0, stream>>>(numbers_.data(), static_cast<u32>(n));
    check_launch("number_kernel");
    order_.reserve(n);
    capacity_ = n;
  }

  // Makes room where there was too little. True where the frame must run again.
  bool grow(const Counters& c, cudaStream_t stream) {
    if (c.found_all <= capacity_) return false;
    reserve(c.found_all + c.found_all / 4, stream);
    return true;
  }

  template <class T>
  void fill(LaunchParams<T>& params) const {
    params.found_keys = keys_.data(), params.found_tocs = tocs_.data(), params.found_capacity = capacity_;
  }

  // Sorts what the frame has found, and writes it out.
  template <class T>
  void launch(Query query, const LaunchParams<T>& params, const Counters& c, int multiprocessors, cudaStream_t stream,
              StageTimer& timer) {
    const auto n = static_cast<u32>(c.found_all);
    const auto roomy = [](u64 x) { return static_cast<std::size_t>(x + x / 4 + 1024); };
    if (query == Query::intersections) {
      if (n > ef_.size()) ef_.reserve(roomy(n));
    } else {
      if (c.found[0] > vf_.size()) vf_.reserve(roomy(c.found[0]));
      if (c.found[1] > ee_.size()) ee_.reserve(roomy(c.found[1]));
      if (n > toc_.size()) toc_.reserve(roomy(n));
    }
    if (n == 0) return;
    sort_pairs(workspace_.data(), workspace_.bytes(), keys_.data(), sorted_keys_.data(), numbers_.data(), order_.data(),
               static_cast<int>(n), key_bits_, stream);
    timer.mark("sort", stream);
    const unsigned blocks = std::min(blocks_for(n, 128), 8u * multiprocessors);
    if (query == Query::intersections)
      intersections_kernel<<<blocks, 128, 0, stream>>>(params, sorted_keys_.data(), n, ef_.data());
    else
      results_kernel<<<blocks, 128, 0, stream>>>(params, sorted_keys_.data(), order_.data(), n,
                                                 static_cast<u32>(c.found[0]), vf_.data(), ee_.data(), toc_.data());
    check_launch("results_kernel");
    timer.mark("results", stream);
  }

  // When the stream has come to its end.
  FrameResult result(Query query, const Counters& c) const {
    FrameResult r;
    r.hash = c.hash;
    if (query == Query::intersections) {
      r.n_ef = c.found_all;
      r.ef = reinterpret_cast<const std::array<u32, 3>*>(ef_.data());
      return r;
    }
    r.n_vf = c.found[0], r.n_ee = c.found[1];
    r.vf = reinterpret_cast<const std::array<u32, 2>*>(vf_.data());
    r.ee = reinterpret_cast<const std::array<u32, 4>*>(ee_.data());
    r.toc = toc_.data();
    return r;
  }

  std::size_t bytes() const {
    return keys_.bytes() + sorted_keys_.bytes() + tocs_.bytes() + numbers_.bytes() + order_.bytes() +
           workspace_.bytes();
  }

 private:
  const int key_bits_;
  std::size_t capacity_ = 0;  // of all lists together
  DeviceBuffer<u64> keys_, sorted_keys_;
  DeviceBuffer<double> tocs_;
  DeviceBuffer<u32> numbers_, order_;
  DeviceBuffer<unsigned char> workspace_;
  PinnedBuffer<uint2> vf_;
  PinnedBuffer<uint4> ee_;
  PinnedBuffer<uint3> ef_;
  PinnedBuffer<double> toc_;
};

}  // namespace hpccd::gpu
