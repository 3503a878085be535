// SPDX-License-Identifier: Apache-2.0
// For builds without CUDA.
#include "gpu/device.h"
#include "gpu/download.h"
#include "gpu/memory_on_device.h"
#include "gpu/pipeline.h"
#include "gpu/placed_search.h"
#include "gpu/results_to_device.h"

namespace hpccd::gpu {

const Status& status() {
  static const Status s{
      false,
      "",
      {},
      "this build has no GPU backends: build on a machine with an NVIDIA GPU and nvcc, or with HPCCD_CUDA=ON"};
  return s;
}

CallersDevice::CallersDevice() = default;
CallersDevice::~CallersDevice() = default;

void fail_after(int) {}

void download(const void*, void*, std::size_t) { throw Error(status().reason); }

std::unique_ptr<Pipeline> Pipeline::create(const Scene&, const Features&, const Options&, const SeparationTable&,
                                           const ThicknessTable&, const FeatureFilter&, int) {
  throw Error(status().reason);
}

std::unique_ptr<PlacedSearch> PlacedSearch::create(const Scene&, const Features&, const Options&,
                                                   const SeparationTable&, const ThicknessTable&, const FeatureFilter&,
                                                   const PlacedMeshes&, int) {
  throw Error(status().reason);
}

DeviceResults to_device(const Contacts&, int) { throw Error(status().reason); }
DeviceResults to_device(const Proximity&, int) { throw Error(status().reason); }
DeviceResults to_device(const Intersections&, int) { throw Error(status().reason); }

void add_places(DeviceResults&, const Contacts&) { throw Error(status().reason); }
std::shared_ptr<const void> joined_on_device(const void*, std::size_t, const void*, std::size_t, int) {
  throw Error(status().reason);
}

std::unique_ptr<MemoryOnDevice> MemoryOnDevice::create() { throw Error(status().reason); }

}  // namespace hpccd::gpu
