// SPDX-License-Identifier: Apache-2.0
// The floating-point mode that all error bounds assume: rounding to nearest, denormal numbers kept, nothing trapped.
// Other libraries set others for their own speed (-ffast-math sets flush-to-zero when its library is loaded), in each
// thread that calls us.
#pragma once

#include <cfenv>
#include <cstdint>

namespace hpccd {

// Sets that mode in this thread while it lives, and then the mode that was there before. A few nanoseconds.
class StandardArithmetic {
 public:
  StandardArithmetic();
  ~StandardArithmetic();
  StandardArithmetic(const StandardArithmetic&) = delete;
  StandardArithmetic& operator=(const StandardArithmetic&) = delete;

 private:
#if defined(__x86_64__)
  std::uint32_t before_;  // MXCSR
#elif defined(__aarch64__)
  std::uint64_t before_;  // FPCR
#else
  std::fenv_t before_;
#endif
};

}  // namespace hpccd
