// SPDX-License-Identifier: Apache-2.0
// From a device to the host, whatever the detector does there: the CPU may be asked before the device is, or instead.
#pragma once

#include <cstddef>

namespace hpccd::gpu {

// Copies what is there when all work on its device has ended. Throws Error.
void download(const void* on_device, void* to, std::size_t bytes);

}  // namespace hpccd::gpu
