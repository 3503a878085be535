// SPDX-License-Identifier: Apache-2.0
// In builds without CUDA.
#include "gpu/device.h"
#include "gpu/download.h"
#include "gpu/memory_on_device.h"
#include "gpu/pipeline.h"

namespace hpccd::gpu {

const Status& status() {
  static const Status s{false, "", {}, "this build holds no CUDA code: no nvcc was found when it was compiled"};
  return s;
}

CallersDevice::CallersDevice() = default;
CallersDevice::~CallersDevice() = default;

void fail_after(int) {}

void download(const void*, void*, std::size_t) { throw Error(status().reason); }

std::unique_ptr<Pipeline> Pipeline::create(const Scene&, const Features&, Accuracy, TestedFeatures,
                                           const SeparationTable&, int, bool) {
  throw Error(status().reason);
}

std::unique_ptr<MemoryOnDevice> MemoryOnDevice::create() { throw Error(status().reason); }

}  // namespace hpccd::gpu
