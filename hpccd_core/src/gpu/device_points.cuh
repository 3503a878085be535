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
  PointsTask bring(Positions points, u32 mesh, bool with_distances, ThreadPool& pool, cudaStream_t stream) {
    const std::size_t n = std::max<std::size_t>(points.n, 1);
    points_.reserve(3 * n), staging_.reserve(3 * n);
    numbers_.reserve(n), host_numbers_.reserve(n), extent_.reserve(1);
    if (with_distances) nearest_.reserve(n), host_nearest_.reserve(n);
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
    return {points_.data(), points.n, mesh, with_distances, numbers_.data(), nearest_.data(), extent_.data()};
  }

  // Waits for the stream.
  std::vector<PointOnFace> results(const PointsTask& task, cudaStream_t stream) {
    const auto fetch = [&](auto* to, const auto* from) {
      check(cudaMemcpyAsync(to, from, task.n * sizeof *to, cudaMemcpyDeviceToHost, stream), "cudaMemcpyAsync");
    };
    fetch(host_numbers_.data(), task.numbers);
    if (task.with_distances) fetch(host_nearest_.data(), task.nearest);
    check(cudaStreamSynchronize(stream), "cudaStreamSynchronize");
    std::vector<PointOnFace> found(task.n, PointOnFace{});
    if (task.with_distances) std::copy_n(host_nearest_.data(), task.n, found.begin());
    for (std::size_t i = 0; i < task.n; ++i) found[i].winding = host_numbers_.data()[i];
    return found;
  }

  std::size_t bytes() const { return points_.bytes() + numbers_.bytes() + nearest_.bytes(); }

 private:
  DeviceBuffer<double> points_;
  PinnedBuffer<double> staging_;
  DeviceBuffer<std::int32_t> numbers_;
  PinnedBuffer<std::int32_t> host_numbers_;
  DeviceBuffer<PointOnFace> nearest_;
  PinnedBuffer<PointOnFace> host_nearest_;
  DeviceBuffer<WorldCounters> extent_;
};

}  // namespace hpccd::gpu
