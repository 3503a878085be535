// SPDX-License-Identifier: Apache-2.0
// The points of a query, and its results, on the device.
#pragma once

#include <algorithm>
#include <vector>

#include "base/parallel.h"
#include "gpu/stages.cuh"
#include "gpu/stream.h"
#include "hpccd/hpccd.h"

namespace hpccd::gpu {

class DevicePoints {
 public:
  // Copies points from the host.
  PointsTask bring(Positions points, u32 mesh, ThreadPool& pool, cudaStream_t stream) {
    const std::size_t n = std::max<std::size_t>(points.n, 1);
    points_.reserve(3 * n), staging_.reserve(3 * n);
    numbers_.reserve(n), host_numbers_.reserve(n);
    double* to = staging_.data();
    parallel_for(pool, 3 * points.n, std::size_t{1} << 15, [&](std::size_t begin, std::size_t end, int) {
      if (points.is_double)
        std::copy(static_cast<const double*>(points.data) + begin, static_cast<const double*>(points.data) + end,
                  to + begin);
      else
        std::copy(static_cast<const float*>(points.data) + begin, static_cast<const float*>(points.data) + end,
                  to + begin);
    });
    check(cudaMemcpyAsync(points_.data(), to, 3 * points.n * sizeof(double), cudaMemcpyHostToDevice, stream),
          "cudaMemcpyAsync");
    return {points_.data(), points.n, mesh, numbers_.data()};
  }

  // Waits for the stream.
  std::vector<std::int32_t> numbers(const PointsTask& task, cudaStream_t stream) {
    std::int32_t* to = host_numbers_.data();
    check(cudaMemcpyAsync(to, task.numbers, task.n * sizeof *to, cudaMemcpyDeviceToHost, stream), "cudaMemcpyAsync");
    check(cudaStreamSynchronize(stream), "cudaStreamSynchronize");
    return {to, to + task.n};
  }

  std::size_t bytes() const { return points_.bytes() + numbers_.bytes(); }

 private:
  DeviceBuffer<double> points_;
  PinnedBuffer<double> staging_;
  DeviceBuffer<std::int32_t> numbers_;
  PinnedBuffer<std::int32_t> host_numbers_;
};

}  // namespace hpccd::gpu
