// SPDX-License-Identifier: Apache-2.0
// The motion of every vertex in this frame, in the layout that later kernels read.
#pragma once

#include <algorithm>

#include "gpu/bounds.cuh"
#include "gpu/stream.h"

namespace hpccd::gpu {

class DeviceMotion {
 public:
  // n_vertices: of each world.
  void reserve(std::size_t n_vertices, u32 n_worlds) {
    const std::size_t n = std::max<std::size_t>(n_vertices * n_worlds, 1);
    kdops_.reserve(n);
    points_.reserve(n);
    vertices_.reserve(n);
    if (n_worlds > 1) worlds_.reserve(n_worlds);
  }

  template <class T>
  void fill(LaunchParams<T>& params) const {
    params.vertices = reinterpret_cast<GivenEnds<T>*>(vertices_.data()), params.points = points_.data();
    params.kdops = kdops_.data();
  }
  // A single world uses the frame's counters.
  template <class T>
  void fill_counters(LaunchParams<T>& params, Counters* counters) const {
    params.counters = counters;
    params.worlds = worlds_.size() ? worlds_.data() : &counters->world;
  }

  // Resets the counters of the worlds.
  void forget(cudaStream_t stream) const {
    if (worlds_.size()) check(cudaMemsetAsync(worlds_.data(), 0, worlds_.bytes(), stream), "cudaMemsetAsync");
  }
  // Computes the extent of the frame's positions; clears its counters.
  template <class T>
  void begin(const LaunchParams<T>& params, int multiprocessors, cudaStream_t stream) const {
    check(cudaMemsetAsync(params.counters, 0, sizeof(Counters), stream), "cudaMemsetAsync");
    forget(stream);
    const unsigned most = std::max(2u * static_cast<unsigned>(multiprocessors) / params.n_worlds, 1u);
    extent_kernel<<<params.n_worlds * std::min(blocks_for(params.n_vertices, 256), most), 256, 0, stream>>>(params);
    check_launch("extent_kernel");
  }
  // Then computes the motion itself.
  template <class T>
  void launch(Query query, const LaunchParams<T>& params, cudaStream_t stream) const {
    if (params.fast) {
      floats_suffice_kernel<<<params.n_worlds, 128, 0, stream>>>(params);
      check_launch("floats_suffice_kernel");
    }
    const auto kernel = of_snapshot(query)         ? vertices_kernel<true, false, T>
                        : query == Query::contacts ? vertices_kernel<false, true, T>
                                                   : vertices_kernel<false, false, T>;
    kernel<<<blocks_for(params.all_vertices(), 256), 256, 0, stream>>>(params);
    check_launch("vertices_kernel");
  }

  std::size_t bytes() const { return points_.bytes() + vertices_.bytes() + kdops_.bytes() + worlds_.bytes(); }

 private:
  DeviceBuffer<GivenEnds<double>> vertices_;  // large enough for floats as well
  DeviceBuffer<DevicePoint> points_;
  DeviceBuffer<VertexKdop> kdops_;
  DeviceBuffer<WorldCounters> worlds_;  // for several worlds
};

}  // namespace hpccd::gpu
