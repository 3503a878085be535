// SPDX-License-Identifier: Apache-2.0
// For builds without CUDA.
#include "gpu/device.h"
#include "hybrid/devices.h"

namespace hpccd::hybrid {

std::vector<std::unique_ptr<TestDevice>> cuda_devices(const Scene&, const Features&, Accuracy, TestedFeatures,
                                                      const SeparationTable&, const ThicknessTable&,
                                                      const FeatureFilter&, int) {
  throw gpu::Error(gpu::status().reason);
}

}  // namespace hpccd::hybrid
