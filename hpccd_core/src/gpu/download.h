// SPDX-License-Identifier: Apache-2.0
// Copies from a device to the host, independent of the detector's state: the CPU may compute before the device, or
// instead of it.
#pragma once

#include <cstddef>

namespace hpccd::gpu {

// Copies after all work on the device has ended. Throws Error.
void download(const void* on_device, void* to, std::size_t bytes);

}  // namespace hpccd::gpu
