// SPDX-License-Identifier: Apache-2.0
// A copy of a device array that stays on its device.
#pragma once

#include <cstddef>
#include <memory>

namespace hpccd::gpu {

class MemoryOnDevice {
 public:
  // Throws Error where there is no device.
  static std::unique_ptr<MemoryOnDevice> create();
  virtual ~MemoryOnDevice() = default;
  // Copies what is there now, when all work on the device has ended. Throws Error.
  virtual void assign(const void* on_device, std::size_t bytes) = 0;
  virtual const void* data() const = 0;
};

}  // namespace hpccd::gpu
