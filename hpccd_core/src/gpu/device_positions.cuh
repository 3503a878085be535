// SPDX-License-Identifier: Apache-2.0
// Copies the caller's positions, wherever they are, to the device of a pipeline.
#pragma once

#include <algorithm>
#include <cstring>
#include <optional>
#include <string>

#include "base/parallel.h"
#include "gpu/stream.h"
#include "hpccd/hpccd.h"

namespace hpccd::gpu {

class DevicePositions {
 public:
  explicit DevicePositions(int device) : device_(device) {}

  // Both ends on the device, as arrays for the stream's later work. Copies through page-locked memory: the driver's own
  // copy from pageable memory takes 100 us per megabyte on one thread. Waking the pool costs as much as copying half a
  // megabyte. Positions on another device are copied from there; those on this device are used in place.
  template <class T>
  void bring(Positions t0, Positions t1, const T* given[2], ThreadPool& pool, cudaStream_t stream) {
    const Positions ends[2] = {t0, t1};
    const std::size_t bytes = 3 * t0.n * sizeof(T), words = std::max<std::size_t>((bytes + 7) / 8, 1);
    char* to[2] = {nullptr, nullptr};
    for (int i = 0; i < 2; ++i) {
      if (i == 1 && ends[1].data == ends[0].data) {  // for one snapshot
        given[1] = given[0];
        break;
      }
      given[i] = static_cast<const T*>(ends[i].data);
      const bool on_device = ends[i].on_device;
      if (on_device && (bytes == 0 || settled_device(ends[i], stream) == device_)) continue;
      given_[i].reserve(words);
      given[i] = reinterpret_cast<const T*>(given_[i].data());
      if (on_device) {
        check(cudaMemcpyAsync(given_[i].data(), ends[i].data, bytes, cudaMemcpyDefault, stream), "cudaMemcpyAsync");
        continue;
      }
      staging_[i].reserve(words);
      to[i] = reinterpret_cast<char*>(staging_[i].data());
    }
    const auto copy = [&](std::size_t begin, std::size_t end, int) {
      for (int i = 0; i < 2; ++i)
        if (to[i]) std::memcpy(to[i] + begin, static_cast<const char*>(ends[i].data) + begin, end - begin);
    };
    if (!to[0] && !to[1]) return;
    if (bytes < (std::size_t{1} << 19))
      copy(0, bytes, 0);
    else
      parallel_for(pool, bytes, std::size_t{1} << 16, copy);
    for (int i = 0; i < 2; ++i)
      if (to[i] && bytes)
        check(cudaMemcpyAsync(given_[i].data(), to[i], bytes, cudaMemcpyHostToDevice, stream), "cudaMemcpyAsync");
  }

  // Makes later work of the stream wait for the work enqueued on the caller's stream so far. Without a stream, waits
  // for all work on the device. Throws InvalidArgument if it is not a stream of this device.
  void wait_for(std::optional<void*> callers, cudaStream_t stream) {
    if (!callers) {
      check(cudaDeviceSynchronize(), "cudaDeviceSynchronize");
      return;
    }
    record(static_cast<cudaStream_t>(*callers), stream);
    check(cudaStreamWaitEvent(stream, made_, 0), "cudaStreamWaitEvent");
  }

  // Throws InvalidArgument if the caller's stream is not a stream of this device; it may be under capture.
  void require_stream(cudaStream_t callers, cudaStream_t ours) const {
    cudaStreamCaptureStatus captured = cudaStreamCaptureStatusNone;
    const cudaError_t result = cudaStreamIsCapturing(callers, &captured);
    if (result != cudaSuccess && cudaStreamIsCapturing(ours, &captured) == cudaSuccess) throw no_stream(result);
    check(result, "cudaStreamIsCapturing");
  }

  std::size_t bytes() const { return given_[0].bytes() + given_[1].bytes(); }

 private:
  // If the same event can be recorded on our own stream, the device has not failed: the caller's stream is invalid.
  void record(cudaStream_t callers, cudaStream_t ours) {
    cudaStreamCaptureStatus captured = cudaStreamCaptureStatusNone;
    cudaError_t result = cudaStreamIsCapturing(callers, &captured);
    if (result == cudaSuccess && captured != cudaStreamCaptureStatusNone)
      throw InvalidArgument(
          "stream: is being captured into a graph, so that its work is not done yet; end the capture, or give another "
          "stream");
    if (result == cudaSuccess) result = cudaEventRecord(made_, callers);
    if (result != cudaSuccess && result != cudaErrorMemoryAllocation && cudaEventRecord(made_, ours) == cudaSuccess)
      throw no_stream(result);
    check(result, "cudaEventRecord");
  }

  InvalidArgument no_stream(cudaError_t result) const {
    cudaGetLastError();  // clears the error
    return InvalidArgument("stream: is no stream of CUDA device " + std::to_string(device_) +
                           ", where this detector works (" + cudaGetErrorString(result) +
                           "); give one of that device, or none");
  }

  // The device on which the caller's array lies. Its producer may still be running: the stream's later work waits for
  // it, or it has ended when this returns.
  int settled_device(const Positions& array, cudaStream_t stream) {
    cudaPointerAttributes a;
    check(cudaPointerGetAttributes(&a, array.data), "cudaPointerGetAttributes");
    const int where = a.type == cudaMemoryTypeDevice ? a.device : device_;
    if (where == device_) {
      wait_for(array.made_on, stream);
      return where;
    }
    check(cudaSetDevice(where), "cudaSetDevice");
    check(cudaDeviceSynchronize(), "cudaDeviceSynchronize");
    check(cudaSetDevice(device_), "cudaSetDevice");
    check(cudaDeviceSynchronize(), "cudaDeviceSynchronize");  // rows here may still be in use
    return where;
  }

  const int device_;
  Event made_;
  PinnedBuffer<double> staging_[2];
  DeviceBuffer<double> given_[2];
};

}  // namespace hpccd::gpu
