// SPDX-License-Identifier: Apache-2.0
// The contacts of a frame: in the order in which kernels find them, in canonical order, and as rows for the caller.
#pragma once

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "gpu/ordering.cuh"
#include "gpu/pipeline.h"
#include "gpu/result_rows.cuh"
#include "gpu/sort.h"
#include "gpu/stages.cuh"

namespace hpccd::gpu {

class DeviceContacts {
 public:
  // n_groups: vertices and edges of all worlds. on_device: rows stay there, and are returned to the caller.
  DeviceContacts(u32 key_bits, std::size_t n_groups, u32 n_worlds, bool on_device)
      : key_bits_(static_cast<int>(key_bits)), n_groups_(n_groups), n_worlds_(n_worlds), pool_(on_device) {
    if (n_groups >= 0x7FFFFFFF) throw Error("2^31 or more vertices and edges in all worlds; use backend=\"cpu\"");
    n_of_group_.reserve_filled(n_groups + 1, 0);
    first_of_group_.reserve(n_groups + 1);
    sum_workspace_.reserve(sum_workspace(static_cast<int>(n_groups + 1)));
  }

  // Allocates memory for n contacts.
  void reserve(std::size_t n) {
    if (n <= capacity_) return;
    if (n > 0x7FFFFFFF) throw Error("more than 2^31 contacts; use backend=\"cpu\"");
    capacity_ = 0;  // if one of these fails, the others have changed
    keys_.reserve(n);
    tocs_.reserve(n);
    placed_.reserve(n);
    capacity_ = n;
  }

  // Enlarges lists that were too short. True if the frame must run again.
  bool grow(const Counters& c) {
    if (c.found_all <= capacity_) return false;
    reserve(c.found_all + c.found_all / 4);
    return true;
  }

  // Provides memory for the rows of the next frame.
  void begin() {
    rows_ = nullptr, rows_ = pool_.take();
    if ((handed_out_ = rows_ != nullptr); !handed_out_) {
      if (!own_) own_ = std::make_shared<RowsIn<PinnedMemory>>();
      rows_ = own_;
    }
    if (n_worlds_ > 1) rows_->reserve_worlds(n_worlds_);
  }
  // The result of a scene without features.
  void find_nothing(cudaStream_t stream) const {
    if (n_worlds_ == 1) return;
    no_rows_kernel<<<blocks_for(n_worlds_ + 1, 256), 256, 0, stream>>>(n_worlds_, rows_->places());
    check_launch("no_rows_kernel");
  }
  // counted: pairs are counted when they are found.
  template <class T>
  void fill(LaunchParams<T>& params, bool counted) const {
    params.found_keys = keys_.data(), params.found_tocs = tocs_.data(), params.found_capacity = capacity_;
    params.n_of_group = counted && params.wanted == Wanted::all ? n_of_group_.data() : nullptr;
  }

  // Sorts the contacts after all stages, and writes them if there is enough memory.
  template <class T>
  void launch(Query query, const LaunchParams<T>& params, const Stages& stages) {
    if (params.wanted != Wanted::all) launch_firsts(params, stages);
    if (!params.n_of_group) {
      check(cudaMemsetAsync(n_of_group_.data(), 0, n_of_group_.bytes(), stages.stream), "cudaMemsetAsync");
      count_kernel<<<blocks(stages), 256, 0, stages.stream>>>(params, n_of_group_.data());
      check_launch("count_kernel");
    }
    sum_before(sum_workspace_.data(), sum_workspace_.bytes(), n_of_group_.data(), first_of_group_.data(),
               static_cast<int>(n_groups_ + 1), stages.stream);
    place_kernel<<<blocks(stages), 256, 0, stages.stream>>>(params, n_of_group_.data(), first_of_group_.data(),
                                                            placed_.data());
    check_launch("place_kernel");
    stages.mark("sort");
    launch_results(query, params, stages);
  }

  // The earliest time of each world among all contacts.
  template <class T>
  void launch_firsts(const LaunchParams<T>& params, const Stages& stages) {
    firsts_kernel<<<blocks(stages), 256, 0, stages.stream>>>(params);
    check_launch("firsts_kernel");
  }

  // Called when the host has read the counters: true if rows had to be written again, after memory was allocated or
  // keys were sorted. Then the counters change again.
  template <class T>
  bool complete(Query query, const LaunchParams<T>& params, const Counters& c, const Stages& stages) {
    const auto roomy = [](u64 x) { return static_cast<std::size_t>(x + x / 4 + 1024); };
    const bool sorts = c.most_of_a_feature > most_of_a_feature;
    bool fits = true;
    if (query == Query::intersections) {
      if (fits = fit<true>(c, rows_->places()); !fits) rows_->reserve_intersections(roomy(c.rows[0] + c.rows[1]));
    } else {
      if (fits = fit<false>(c, rows_->places()); !fits) rows_->reserve(roomy(c.rows[0]), roomy(c.rows[1]));
    }
    if (sorts)
      launch_sorted(query, params, static_cast<int>(c.found_all), stages);
    else if (!fits)
      launch_results(query, params, stages);
    return sorts || !fits;
  }

  // Appends to the n contacts; waits for the stream.
  void append(std::size_t n, const std::vector<u64>& keys, const std::vector<double>& tocs, cudaStream_t stream) {
    const std::size_t more = keys.size();
    if (n + more > capacity_) {
      std::vector<u64> all_keys(n);
      std::vector<double> all_tocs(n);
      copy(all_keys.data(), keys_.data(), n, cudaMemcpyDeviceToHost, stream);
      copy(all_tocs.data(), tocs_.data(), n, cudaMemcpyDeviceToHost, stream);
      reserve(n + more);
      copy(keys_.data(), all_keys.data(), n, cudaMemcpyHostToDevice, stream);
      copy(tocs_.data(), all_tocs.data(), n, cudaMemcpyHostToDevice, stream);
    }
    copy(keys_.data() + n, keys.data(), more, cudaMemcpyHostToDevice, stream);
    copy(tocs_.data() + n, tocs.data(), more, cudaMemcpyHostToDevice, stream);
  }

  template <class T>
  void forget_results(const LaunchParams<T>& params, cudaStream_t stream) const {
    forget_results_kernel<<<blocks_for(n_worlds_, 256), 256, 0, stream>>>(params);
    check_launch("forget_results_kernel");
  }

  // Memory for rows, for the last frame's result.
  ResultPlaces reserve_rows(u64 n_vf, u64 n_ee) const {
    rows_->reserve(n_vf, n_ee);
    return rows_->places();
  }
  ResultPlaces places() const { return rows_->places(); }
  std::size_t capacity() const { return capacity_; }
  PlacesOut reserve_places(u64 n_rows, Outputs outputs) const { return rows_->reserve_places(n_rows, outputs); }

  // The result, once the stream has finished.
  FrameResult result(Query query, const Counters& c) const {
    const ResultPlaces from = rows_->places();
    FrameResult r;
    if (handed_out_) r.memory = rows_;
    r.hash = c.world.hash;
    if (n_worlds_ > 1) {
      const auto given = [](const u64* p) { return reinterpret_cast<const std::uint64_t*>(p); };
      r.vf_offsets = given(from.vf_offsets), r.ee_offsets = given(from.ee_offsets), r.hashes = given(from.hashes);
      r.first_tocs = from.first_tocs;
    }
    if (query == Query::intersections) {
      r.n_ef = c.rows[0] + c.rows[1];
      r.ef_offsets = std::exchange(r.vf_offsets, nullptr), r.ee_offsets = nullptr, r.first_tocs = nullptr;
      r.ef = reinterpret_cast<const std::array<u32, 3>*>(from.ef);
      return r;
    }
    r.n_vf = c.rows[0], r.n_ee = c.rows[1];
    r.vf = reinterpret_cast<const std::array<u32, 2>*>(from.vf);
    r.ee = reinterpret_cast<const std::array<u32, 4>*>(from.ee);
    r.toc = from.toc;
    if (c.world.first_toc) r.first_toc = std::bit_cast<double>(~c.world.first_toc);
    return r;
  }

  std::size_t bytes() const {
    return keys_.bytes() + tocs_.bytes() + placed_.bytes() + n_of_group_.bytes() + first_of_group_.bytes() +
           sum_workspace_.bytes() + sortable_keys_.bytes() + sorted_keys_.bytes() + numbers_.bytes() + order_.bytes() +
           sort_workspace_.bytes() + pool_.device_bytes();
  }

 private:
  // 256 threads per block: half of what a multiprocessor holds. With all of them 30 million rows take a third longer
  // (H100).
  static unsigned blocks(const Stages& stages) { return 4 * static_cast<unsigned>(stages.multiprocessors); }

  template <class X>
  static void copy(X* to, const X* from, std::size_t n, cudaMemcpyKind kind, cudaStream_t stream) {
    check(cudaMemcpyAsync(to, from, n * sizeof(X), kind, stream), "cudaMemcpyAsync");
    check(cudaStreamSynchronize(stream), "cudaStreamSynchronize");
  }

  template <class T>
  void launch_results(Query query, const LaunchParams<T>& params, const Stages& stages) {
    const auto kernel = query == Query::intersections ? results_kernel<true, T> : results_kernel<false, T>;
    kernel<<<4 * blocks(stages), 128, 0, stages.stream>>>(params, first_of_group_.data(), placed_.data(),
                                                          rows_->places());
    check_launch("results_kernel");
    launch_worlds(query, params, stages);
    stages.mark("results");
  }

  template <class T>
  void launch_worlds(Query query, const LaunchParams<T>& params, const Stages& stages) {
    if (n_worlds_ == 1) return;
    const auto kernel = query == Query::intersections ? worlds_kernel<true, T> : worlds_kernel<false, T>;
    kernel<<<blocks_for(n_worlds_ + 1, 256), 256, 0, stages.stream>>>(params, first_of_group_.data(), rows_->places());
    check_launch("worlds_kernel");
  }

  template <class T>
  void launch_sorted(Query query, const LaunchParams<T>& params, int n, const Stages& stages) {
    const auto size = static_cast<std::size_t>(n);
    sortable_keys_.reserve(size), sorted_keys_.reserve(size), numbers_.reserve(size), order_.reserve(size);
    sort_workspace_.reserve(sort_workspace(n, key_bits_ + 1));
    sortable_kernel<<<blocks(stages), 256, 0, stages.stream>>>(params, sortable_keys_.data(), numbers_.data());
    check_launch("sortable_kernel");
    sort_pairs(sort_workspace_.data(), sort_workspace_.bytes(), sortable_keys_.data(), sorted_keys_.data(),
               numbers_.data(), order_.data(), n, key_bits_ + 1, stages.stream);
    stages.mark("sort");
    const auto kernel =
        query == Query::intersections ? sorted_results_kernel<true, T> : sorted_results_kernel<false, T>;
    kernel<<<4 * blocks(stages), 128, 0, stages.stream>>>(params, sorted_keys_.data(), order_.data(), rows_->places());
    check_launch("sorted_results_kernel");
    launch_worlds(query, params, stages);
    stages.mark("results");
  }

  const int key_bits_;
  const std::size_t n_groups_;
  const u32 n_worlds_;
  std::size_t capacity_ = 0;  // of the contacts
  DeviceBuffer<u64> keys_;
  DeviceBuffer<double> tocs_;
  DeviceBuffer<PlacedPair> placed_;
  DeviceBuffer<u32> n_of_group_, first_of_group_;
  DeviceBuffer<unsigned char> sum_workspace_;
  // For features with more pairs than most_of_a_feature.
  DeviceBuffer<u64> sortable_keys_, sorted_keys_;
  DeviceBuffer<u32> numbers_, order_;
  DeviceBuffer<unsigned char> sort_workspace_;
  RowsPool pool_;
  std::shared_ptr<ResultRows> rows_, own_;  // of the frame; rows that are not returned to the caller
  bool handed_out_ = false;
};

}  // namespace hpccd::gpu
