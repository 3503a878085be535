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
    points_.reserve(std::max<std::size_t>(n_vertices, 1));
    rows_.reserve(std::max<std::size_t>(n_vertices, 1));
  }

  template <class T>
  void fill(Frame<T>& f) const {
    f.rows = reinterpret_cast<Row<T>*>(rows_.data()), f.points = points_.data();
  }

  // From the positions that the frame names; clears its counters.
  template <class T>
  void launch(const Frame<T>& f, int multiprocessors, cudaStream_t stream) const {
    check(cudaMemsetAsync(f.counters, 0, sizeof(Counters), stream), "cudaMemsetAsync");
    extent_kernel<<<std::min(blocks_for(f.n_vertices, 256), 2u * multiprocessors), 256, 0, stream>>>(f);
    check_launch("extent_kernel");
    rows_kernel<<<blocks_for(f.n_vertices, 256), 256, 0, stream>>>(f);
    check_launch("rows_kernel");
  }

  std::size_t bytes() const { return points_.bytes() + rows_.bytes(); }

 private:
  DeviceBuffer<Row<double>> rows_;  // room for floats, too
  DeviceBuffer<DevicePoint> points_;
};

}  // namespace hpccd::gpu
