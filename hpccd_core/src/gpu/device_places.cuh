// SPDX-License-Identifier: Apache-2.0
// Points, normals and nearest points of results that stay on the device.
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "gpu/pipeline.h"
#include "gpu/places_task.cuh"

namespace hpccd::gpu {

class DevicePlaces {
 public:
  // Computes outputs for the rows of a result; `to` must be large enough. Returns the rows that only integers can
  // decide, which are not written; or nothing if there are too many, and the host should compute all rows. Waits for
  // the stream.
  template <class T>
  std::optional<std::vector<OpenRow>> find(const LaunchParams<T>& params, const FrameResult& r, const u64* n_rows,
                                           const PlacesOut& to, const Stages& stages) {
    reserve(r.n_vf + r.n_ee);
    const PlacesTask task = launch(params, r, n_rows, to, stages);
    u64 n_open[2] = {};
    fetch(n_open, n_open_.data(), 2, stages.stream);
    if (n_open[0] > task.open_capacity) return std::nullopt;
    std::vector<OpenRow> open(n_open[1]);
    fetch(open.data(), to_host_.data(), n_open[1], stages.stream);
    return open;
  }

  // For up to this many rows.
  void reserve(u64 n_rows) {
    n_open_.reserve(2);
    open_.reserve(static_cast<std::size_t>(std::max<u64>(n_rows / most_open, 16384)));
    to_host_.reserve(open_.size());
  }
  // The rows of a frame: as many as n_rows says when the stream gets there. Does not wait, and allocates nothing.
  template <class T>
  PlacesTask launch(const LaunchParams<T>& params, const FrameResult& r, const u64* n_rows, const PlacesOut& to,
                    const Stages& stages) {
    check(cudaMemsetAsync(n_open_.data(), 0, n_open_.bytes(), stages.stream), "cudaMemsetAsync");
    const auto offsets = [](const std::uint64_t* p) { return reinterpret_cast<const u64*>(p); };
    const PlacesTask task{n_rows,
                          reinterpret_cast<const uint2*>(r.vf),
                          reinterpret_cast<const uint4*>(r.ee),
                          r.toc,
                          offsets(r.vf_offsets),
                          offsets(r.ee_offsets),
                          to,
                          open_.data(),
                          to_host_.data(),
                          std::min(open_.size(), to_host_.size()),
                          n_open_.data()};
    launch_places(params, task, stages);
    launch_places_in_integers(task, stages);
    return task;
  }

  // Writes the host's results for the rows that were returned last.
  void put(const PlacesOut& to, const std::vector<PairPlaces>& places, const Stages& stages) {
    if (places.empty()) return;
    places_.reserve(places.size());
    check(cudaMemcpyAsync(places_.data(), places.data(), places.size() * sizeof places[0], cudaMemcpyHostToDevice,
                          stages.stream),
          "cudaMemcpyAsync");
    launch_put(to, to_host_.data(), places_.data(), places.size(), stages);
    check(cudaStreamSynchronize(stages.stream), "cudaStreamSynchronize");
  }

  std::size_t bytes() const { return open_.bytes() + to_host_.bytes() + n_open_.bytes() + places_.bytes(); }

 private:
  static constexpr u64 most_open = 8;  // at most one of this many rows

  template <class X>
  static void fetch(X* to, const X* from, u64 n, cudaStream_t stream) {
    if (n) check(cudaMemcpyAsync(to, from, n * sizeof(X), cudaMemcpyDeviceToHost, stream), "cudaMemcpyAsync");
    check(cudaStreamSynchronize(stream), "cudaStreamSynchronize");
  }

  DeviceBuffer<OpenRow> open_, to_host_;
  DeviceBuffer<u64> n_open_;
  DeviceBuffer<PairPlaces> places_;
};

}  // namespace hpccd::gpu
