// SPDX-License-Identifier: Apache-2.0
// This machine's GPUs as devices of the hybrid backend.
#pragma once

#include <memory>
#include <vector>

#include "gpu/device.h"
#include "hybrid/test_device.h"
#include "scene/features.h"

namespace hpccd::gpu {

// The first `gpus` of them, 0: all. Scene and features must outlive them. Throws Error where there are none, or too
// little memory.
std::vector<std::unique_ptr<hybrid::TestDevice>> hybrid_devices(const Scene& scene, const Features& features,
                                                                Accuracy accuracy, int gpus);

}  // namespace hpccd::gpu
