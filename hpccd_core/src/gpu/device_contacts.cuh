// SPDX-License-Identifier: Apache-2.0
// The contacts of a frame: as the kernels find them, in canonical order, and as the caller sees them.
#pragma once

#include <algorithm>
#include <array>
#include <utility>

#include "gpu/ordering.cuh"
#include "gpu/pipeline.h"
#include "gpu/result_rows.cuh"
#include "gpu/sort.h"
#include "gpu/stream.h"

namespace hpccd::gpu {

class DeviceContacts {
 public:
  // n_groups: vertices and edges.
  DeviceContacts(u32 key_bits, std::size_t n_groups)
      : key_bits_(static_cast<int>(key_bits)), n_groups_(n_groups), rows_(std::make_shared<RowsIn<PinnedMemory>>()) {
    if (n_groups >= 0x7FFFFFFF) throw Error("2^31 or more vertices and edges; use backend=\"cpu\"");
    n_of_group_.reserve(n_groups + 1);
    check(cudaMemset(n_of_group_.data(), 0, n_of_group_.bytes()), "cudaMemset");
    first_of_group_.reserve(n_groups + 1);
    sum_workspace_.reserve(sum_workspace(static_cast<int>(n_groups + 1)));
  }

  // Room for n to be found.
  void reserve(std::size_t n) {
    if (n <= capacity_) return;
    if (n > 0x7FFFFFFF) throw Error("more than 2^31 contacts; use backend=\"cpu\"");
    capacity_ = 0;  // should one of these fail, the others have changed
    keys_.reserve(n);
    tocs_.reserve(n);
    placed_.reserve(n);
    capacity_ = n;
  }

  // Makes room where there was too little. True where the frame must run again.
  bool grow(const Counters& c) {
    if (c.found_all <= capacity_) return false;
    reserve(c.found_all + c.found_all / 4);
    return true;
  }

  // ordered: the frame wants results, not only what was found.
  template <class T>
  void fill(LaunchParams<T>& params, bool ordered) const {
    params.found_keys = keys_.data(), params.found_tocs = tocs_.data(), params.found_capacity = capacity_;
    params.n_of_group = ordered ? n_of_group_.data() : nullptr;
  }

  // After all that finds contacts: brings them in order, and writes them out if there is room for them.
  template <class T>
  void launch(Query query, const LaunchParams<T>& params, int multiprocessors, cudaStream_t stream, StageTimer& timer) {
    sum_before(sum_workspace_.data(), sum_workspace_.bytes(), n_of_group_.data(), first_of_group_.data(),
               static_cast<int>(n_groups_ + 1), stream);
    place_kernel<<<static_cast<unsigned>(4 * multiprocessors), 256, 0, stream>>>(params, first_of_group_.data(),
                                                                                 placed_.data());
    check_launch("place_kernel");
    timer.mark("sort", stream);
    launch_results(query, params, multiprocessors, stream, timer);
  }

  // When the host has the counters: whether they must be written out again, now that there is room, or keys are sorted.
  // Then the counters change once more.
  template <class T>
  bool complete(Query query, const LaunchParams<T>& params, const Counters& c, int multiprocessors, cudaStream_t stream,
                StageTimer& timer) {
    const auto roomy = [](u64 x) { return static_cast<std::size_t>(x + x / 4 + 1024); };
    const ResultPlaces to = rows_->places();
    const bool sorts = c.most_of_a_feature > most_of_a_feature;
    bool short_of_room = false;
    if (query == Query::intersections) {
      if ((short_of_room = c.found_all > to.most_ef)) rows_->reserve_intersections(roomy(c.found_all));
    } else if ((short_of_room = c.found[0] > to.most_vf || c.found[1] > to.most_ee)) {
      rows_->reserve(roomy(c.found[0]), roomy(c.found[1]));
    }
    if (sorts)
      launch_sorted(query, params, static_cast<int>(c.found_all), multiprocessors, stream, timer);
    else if (short_of_room)
      launch_results(query, params, multiprocessors, stream, timer);
    return sorts || short_of_room;
  }

  // When the stream has come to its end.
  FrameResult result(Query query, const Counters& c) const {
    const ResultPlaces from = rows_->places();
    FrameResult r;
    r.hash = c.hash;
    if (query == Query::intersections) {
      r.n_ef = c.found_all;
      r.ef = reinterpret_cast<const std::array<u32, 3>*>(from.ef);
      return r;
    }
    r.n_vf = c.found[0], r.n_ee = c.found[1];
    r.vf = reinterpret_cast<const std::array<u32, 2>*>(from.vf);
    r.ee = reinterpret_cast<const std::array<u32, 4>*>(from.ee);
    r.toc = from.toc;
    return r;
  }

  std::size_t bytes() const {
    return keys_.bytes() + tocs_.bytes() + placed_.bytes() + n_of_group_.bytes() + first_of_group_.bytes() +
           sum_workspace_.bytes() + sorted_keys_.bytes() + numbers_.bytes() + order_.bytes() + sort_workspace_.bytes() +
           rows_->device_bytes();
  }

 private:
  template <class T>
  void launch_results(Query query, const LaunchParams<T>& params, int multiprocessors, cudaStream_t stream,
                      StageTimer& timer) {
    const auto kernel = query == Query::intersections ? results_kernel<true, T> : results_kernel<false, T>;
    kernel<<<static_cast<unsigned>(8 * multiprocessors), 128, 0, stream>>>(params, first_of_group_.data(),
                                                                           placed_.data(), rows_->places());
    check_launch("results_kernel");
    timer.mark("results", stream);
  }

  template <class T>
  void launch_sorted(Query query, const LaunchParams<T>& params, int n, int multiprocessors, cudaStream_t stream,
                     StageTimer& timer) {
    const auto size = static_cast<std::size_t>(n);
    sorted_keys_.reserve(size), numbers_.reserve(size), order_.reserve(size);
    sort_workspace_.reserve(sort_workspace(n, key_bits_));
    number_kernel<<<blocks_for(size, 256), 256, 0, stream>>>(numbers_.data(), static_cast<u32>(n));
    check_launch("number_kernel");
    sort_pairs(sort_workspace_.data(), sort_workspace_.bytes(), keys_.data(), sorted_keys_.data(), numbers_.data(),
               order_.data(), n, key_bits_, stream);
    timer.mark("sort", stream);
    const auto kernel =
        query == Query::intersections ? sorted_results_kernel<true, T> : sorted_results_kernel<false, T>;
    kernel<<<static_cast<unsigned>(8 * multiprocessors), 128, 0, stream>>>(params, sorted_keys_.data(), order_.data(),
                                                                           rows_->places());
    check_launch("sorted_results_kernel");
    timer.mark("results", stream);
  }

  const int key_bits_;
  const std::size_t n_groups_;
  std::size_t capacity_ = 0;  // of what is found
  DeviceBuffer<u64> keys_;
  DeviceBuffer<double> tocs_;
  DeviceBuffer<PlacedPair> placed_;
  DeviceBuffer<u32> n_of_group_, first_of_group_;
  DeviceBuffer<unsigned char> sum_workspace_;
  // Where a feature has more than most_of_a_feature.
  DeviceBuffer<u64> sorted_keys_;
  DeviceBuffer<u32> numbers_, order_;
  DeviceBuffer<unsigned char> sort_workspace_;
  std::shared_ptr<ResultRows> rows_;
};

}  // namespace hpccd::gpu
