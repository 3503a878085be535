// SPDX-License-Identifier: Apache-2.0
// Lists the usable GPUs, or the reason why there is none. Compiled with and without CUDA.
#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>
#include <vector>

namespace hpccd::gpu {

struct Device {
  std::string name;
  int number = 0, major = 0, minor = 0, multiprocessors = 0;
  std::size_t memory = 0;  // bytes
};

struct Status {
  bool compiled = false;        // whether this build contains CUDA code
  std::string toolkit;          // CUDA's version, and the architectures
  std::vector<Device> devices;  // the devices that can run this build's code
  std::string reason;           // why there are none; empty if there are any
};

// Determined once. Never throws: a machine without a GPU is no error.
const Status& status();

// A failed CUDA call, or exhausted device memory. The CPU can complete the frame.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Restores the thread's current device at the end: other users of CUDA in the thread (CuPy, PyTorch) rely on it.
class CallersDevice {
 public:
  CallersDevice();
  ~CallersDevice();
  CallersDevice(const CallersDevice&) = delete;
  CallersDevice& operator=(const CallersDevice&) = delete;

 private:
  int device_ = -1;  // none, or unknown
};

// For tests: makes the n-th of the next checked CUDA calls fail (1: the next one; 0: none).
void fail_after(int checked_calls);

}  // namespace hpccd::gpu
