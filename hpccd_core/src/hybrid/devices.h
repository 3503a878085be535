// SPDX-License-Identifier: Apache-2.0
// This machine's GPUs as devices of the hybrid backend.
#pragma once

#include <memory>
#include <vector>

#include "hybrid/test_device.h"
#include "scene/feature_filter.h"
#include "scene/features.h"
#include "scene/separation_table.h"
#include "scene/thickness.h"

namespace hpccd::hybrid {

// The first `gpus` devices, 0: all. Scene, features, separations and filter must outlive them; separations may change
// between frames. Throws gpu::Error if there are none, or too little memory.
std::vector<std::unique_ptr<TestDevice>> cuda_devices(const Scene& scene, const Features& features, Accuracy accuracy,
                                                      TestedFeatures tested, const SeparationTable& separations,
                                                      const ThicknessTable& thickness, const FeatureFilter& filter,
                                                      int gpus);

}  // namespace hpccd::hybrid
