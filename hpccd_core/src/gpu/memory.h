// SPDX-License-Identifier: Apache-2.0
// Device and page-locked memory. Buffers only grow, so frames allocate nothing once sizes have settled.
#pragma once

#include <cstddef>
#include <utility>

#include "gpu/cuda_call.h"

namespace hpccd::gpu {

struct DeviceMemory {
  static cudaError_t allocate(void** p, std::size_t bytes) { return cudaMalloc(p, bytes); }
  static void release(void* p) {
    // While a graph is captured, cudaFree is an error otherwise: of whoever lets go of a result then.
    cudaStreamCaptureMode mode = cudaStreamCaptureModeRelaxed;
    cudaThreadExchangeStreamCaptureMode(&mode);
    cudaFree(p);
    cudaThreadExchangeStreamCaptureMode(&mode);
  }
  static constexpr const char* name = "cudaMalloc";
};

struct PinnedMemory {
  static cudaError_t allocate(void** p, std::size_t bytes) { return cudaHostAlloc(p, bytes, cudaHostAllocPortable); }
  static void release(void* p) { cudaFreeHost(p); }
  static constexpr const char* name = "cudaHostAlloc";
};

template <class T, class Memory>
class Buffer {
 public:
  Buffer() = default;
  ~Buffer() { release(); }
  Buffer(const Buffer&) = delete;
  Buffer& operator=(const Buffer&) = delete;

  // Allocates memory for n elements; the contents are lost when it grows.
  void reserve(std::size_t n) {
    if (n <= size_) return;
    release();
    void* p = nullptr;
    check(Memory::allocate(&p, n * sizeof(T)), Memory::name);
    data_ = static_cast<T*>(p);
    size_ = n;
  }
  // The same for device memory; each byte is set when it grows. After a failure there is no memory.
  void reserve_filled(std::size_t n, int byte) {
    if (n <= size_) return;
    reserve(n);
    try {
      check(cudaMemset(data_, byte, bytes()), "cudaMemset");
      check(cudaStreamSynchronize(nullptr), "cudaStreamSynchronize");  // for kernels on any stream
    } catch (...) {
      release();
      throw;
    }
  }
  T* data() const { return data_; }
  std::size_t size() const { return size_; }
  std::size_t bytes() const { return size_ * sizeof(T); }

 private:
  void release() {
    if (data_) Memory::release(data_);
    data_ = nullptr;
    size_ = 0;
  }
  T* data_ = nullptr;
  std::size_t size_ = 0;
};

template <class T>
using DeviceBuffer = Buffer<T, DeviceMemory>;
template <class T>
using PinnedBuffer = Buffer<T, PinnedMemory>;

}  // namespace hpccd::gpu
