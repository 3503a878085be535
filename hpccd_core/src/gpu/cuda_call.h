// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cuda_runtime.h>

#include "gpu/device.h"

namespace hpccd::gpu {

// Checks the result of a CUDA call; throws Error with CUDA's message.
void check(cudaError_t result, const char* what);
inline void check_launch(const char* kernel) { check(cudaGetLastError(), kernel); }

}  // namespace hpccd::gpu
