// SPDX-License-Identifier: Apache-2.0
// A copy of a device array that stays on its device.
#pragma once

#include <cstddef>
#include <memory>

namespace hpccd::gpu {

class MemoryOnDevice {
 public:
  // Throws Error without a device.
  static std::unique_ptr<MemoryOnDevice> create();
  virtual ~MemoryOnDevice() = default;
  // Copies device memory whose writer has ended, as after a query of these positions. Does not wait for other work on
  // the device. Throws Error.
  virtual void assign(const void* on_device, std::size_t bytes) = 0;
  virtual const void* data() const = 0;
};

}  // namespace hpccd::gpu
