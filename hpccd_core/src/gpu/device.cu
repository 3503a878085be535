// SPDX-License-Identifier: Apache-2.0
#include <atomic>

#include "gpu/cuda_call.h"
#include "gpu/download.h"
#include "gpu/memory_on_device.h"

#ifndef HPCCD_CUDA_ARCHITECTURES_TEXT
#define HPCCD_CUDA_ARCHITECTURES_TEXT "default architecture"
#endif

namespace hpccd::gpu {
namespace {

std::atomic<int> calls_until_failure{0};

__global__ void probe(int* answer) { *answer = 42; }

// Whether code of this build runs on the device: on a chip older than the build's architectures only a launch fails.
std::string why_unusable(int device) {
  cudaFuncAttributes attributes;
  cudaError_t e = cudaSetDevice(device);
  if (e == cudaSuccess) e = cudaFuncGetAttributes(&attributes, probe);
  if (e == cudaSuccess) return "";
  cudaGetLastError();
  return cudaGetErrorString(e);
}

Status look() {
  const CallersDevice callers;
  Status s;
  s.compiled = true;
  const int version = CUDART_VERSION;
  s.toolkit = "CUDA " + std::to_string(version / 1000) + "." + std::to_string(version % 1000 / 10) + ", " +
              HPCCD_CUDA_ARCHITECTURES_TEXT;
  int n = 0;
  if (const cudaError_t e = cudaGetDeviceCount(&n); e != cudaSuccess) {
    cudaGetLastError();
    s.reason = cudaGetErrorString(e);
    return s;
  }
  if (n == 0) s.reason = "no CUDA device";
  for (int i = 0; i < n; ++i) {
    cudaDeviceProp p;
    if (cudaGetDeviceProperties(&p, i) != cudaSuccess) continue;
    if (const std::string why = why_unusable(i); !why.empty()) {
      s.reason = std::string(p.name) + ": " + why;
      continue;
    }
    s.devices.push_back({p.name, i, p.major, p.minor, p.multiProcessorCount, p.totalGlobalMem});
  }
  if (!s.devices.empty()) s.reason.clear();
  return s;
}

class DeviceCopy final : public MemoryOnDevice {
 public:
  ~DeviceCopy() override {
    cudaFree(data_);
    if (stream_) cudaStreamDestroy(stream_);
  }
  void assign(const void* from, std::size_t bytes) override {
    const CallersDevice callers;
    cudaPointerAttributes a;
    check(cudaPointerGetAttributes(&a, from), "cudaPointerGetAttributes");
    check(cudaSetDevice(a.device), "cudaSetDevice");
    if (bytes > size_) {
      check(cudaFree(data_), "cudaFree");
      data_ = nullptr, size_ = 0;
      check(cudaMalloc(&data_, bytes), "cudaMalloc");
      size_ = bytes;
    }
    if (bytes == 0) return;
    // The default stream would wait for the caller's streams.
    if (!stream_) check(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking), "cudaStreamCreateWithFlags");
    check(cudaMemcpyAsync(data_, from, bytes, cudaMemcpyDefault, stream_), "cudaMemcpyAsync");
    check(cudaStreamSynchronize(stream_), "cudaStreamSynchronize");
  }
  const void* data() const override { return data_; }

 private:
  void* data_ = nullptr;
  std::size_t size_ = 0;
  cudaStream_t stream_ = nullptr;
};

}  // namespace

std::unique_ptr<MemoryOnDevice> MemoryOnDevice::create() {
  if (status().devices.empty()) throw Error(status().reason);
  return std::make_unique<DeviceCopy>();
}

void download(const void* from, void* to, std::size_t bytes) {
  if (bytes == 0) return;
  const CallersDevice callers;
  cudaPointerAttributes a;
  check(cudaPointerGetAttributes(&a, from), "cudaPointerGetAttributes");
  if (a.device >= 0) check(cudaSetDevice(a.device), "cudaSetDevice");
  check(cudaDeviceSynchronize(), "cudaDeviceSynchronize");  // the producer may use any stream
  check(cudaMemcpy(to, from, bytes, cudaMemcpyDefault), "cudaMemcpy");
}

const Status& status() {
  static const Status s = look();
  return s;
}

CallersDevice::CallersDevice() {
  if (cudaGetDevice(&device_) == cudaSuccess) return;
  cudaGetLastError();
  device_ = -1;
}

CallersDevice::~CallersDevice() {
  if (device_ >= 0 && cudaSetDevice(device_) != cudaSuccess) cudaGetLastError();
}

void fail_after(int checked_calls) { calls_until_failure = checked_calls; }

void check(cudaError_t result, const char* what) {
  if (calls_until_failure.load(std::memory_order_relaxed) > 0 && calls_until_failure.fetch_sub(1) == 1)
    throw Error(std::string(what) + ": failure asked for by a test");
  if (result == cudaSuccess) return;
  cudaGetLastError();  // clears errors that are not sticky
  throw Error(std::string(what) + ": " + cudaGetErrorString(result));
}

}  // namespace hpccd::gpu
