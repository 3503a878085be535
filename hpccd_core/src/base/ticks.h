// SPDX-License-Identifier: Apache-2.0
// The processor's own clock: a look takes 10 ns and calls nothing, so that kernels of any instruction set may look.
// Only ratios of differences mean something. 0 where there is no such clock.
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
