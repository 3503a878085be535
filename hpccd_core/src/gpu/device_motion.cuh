// SPDX-License-Identifier: Apache-2.0
// This frame's motion of every vertex, as the later kernels read it.
#pragma once

#include <algorithm>

#include "gpu/bounds.cuh"
#include "gpu/stream.h"

namespace hpccd::gpu {

class DeviceMotion {
 public:
  void reserve(std::size_t n_vertices) {
    kdops_.reserve(std::max<std::size_t>(n_vertices, 1));
    points_.reserve(std::max<std::size_t>(n_vertices, 1));
    vertices_.reserve(std::max<std::size_t>(n_vertices, 1));
  }

  template <class T>
  void fill(LaunchParams<T>& params) const {
    params.vertices = reinterpret_cast<GivenEnds<T>*>(vertices_.data()), params.points = points_.data();
    params.kdops = kdops_.data();
  }

  // How far the positions reach that the frame names; clears its counters.
  template <class T>
  void begin(const LaunchParams<T>& params, int multiprocessors, cudaStream_t stream) const {
    check(cudaMemsetAsync(params.counters, 0, sizeof(Counters), stream), "cudaMemsetAsync");
    extent_kernel<<<std::min(blocks_for(params.n_vertices, 256), 2u * multiprocessors), 256, 0, stream>>>(params);
    check_launch("extent_kernel");
  }
  // Then the motion itself.
  template <class T>
  void launch(Query query, const LaunchParams<T>& params, cudaStream_t stream) const {
    const auto kernel = of_snapshot(query)           ? vertices_kernel<true, false, T>
                        : query == Query::contacts ? vertices_kernel<false, true, T>
                                                   : vertices_kernel<false, false, T>;
    kernel<<<blocks_for(params.n_vertices, 256), 256, 0, stream>>>(params);
    check_launch("vertices_kernel");
  }

  std::size_t bytes() const { return points_.bytes() + vertices_.bytes() + kdops_.bytes(); }

 private:
  DeviceBuffer<GivenEnds<double>> vertices_;  // room for floats, too
  DeviceBuffer<DevicePoint> points_;
  DeviceBuffer<VertexKdop> kdops_;
};

}  // namespace hpccd::gpu
