// SPDX-License-Identifier: Apache-2.0
// The floating-point mode that all error bounds assume: rounding to nearest, denormal numbers kept, no traps. Other
// libraries may set another mode in the calling threads for speed (loading a library that was compiled with
// -ffast-math sets flush-to-zero).
#pragma once

#include <cfenv>
#include <cstdint>

namespace hpccd {

// Sets that mode in this thread for its lifetime, then restores the previous mode. Takes a few nanoseconds.
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
