// SPDX-License-Identifier: Apache-2.0
// This machine's GPUs as devices of the hybrid backend.
#pragma once

#include <memory>
#include <vector>

#include "hybrid/test_device.h"
#include "scene/features.h"

namespace hpccd::hybrid {

// The first `gpus` of them, 0: all. Scene and features must outlive them. Throws gpu::Error where there are none,
// or too little memory.
std::vector<std::unique_ptr<TestDevice>> cuda_devices(const Scene& scene, const Features& features, Accuracy accuracy,
                                                      int gpus);

}  // namespace hpccd::hybrid
