// SPDX-License-Identifier: Apache-2.0
// The processor's own clock. A reading takes 10 ns and calls no function, so kernels of any instruction set may use
// it. Only ratios of differences are meaningful. 0 if the machine has no such clock.
#pragma once

#include <cstdint>

#include "base/hd.h"

namespace hpccd {

HPCCD_HD std::uint64_t ticks() {
#if defined(__x86_64__)
  return __builtin_ia32_rdtsc();
#elif defined(__aarch64__)
  std::uint64_t now;
  __asm__ __volatile__("mrs %0, cntvct_el0" : "=r"(now));
  return now;
#else
  return 0;
#endif
}

}  // namespace hpccd
