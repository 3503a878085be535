// SPDX-License-Identifier: Apache-2.0
// Counts zero bits at the ends of a number. std::countl_zero and std::countr_zero compile for GPUs but return 64 there
// for every number (nvcc 13.0).
#pragma once

#include <bit>
#include <cstdint>

#include "base/hd.h"

namespace hpccd {

HPCCD_HD int leading_zeros(std::uint64_t x) {
#if defined(__CUDA_ARCH__)
  return __clzll(static_cast<long long>(x));
#else
  return std::countl_zero(x);
#endif
}

HPCCD_HD int trailing_zeros(std::uint64_t x) {
#if defined(__CUDA_ARCH__)
  return x ? __ffsll(static_cast<long long>(x)) - 1 : 64;
#else
  return std::countr_zero(x);
#endif
}

}  // namespace hpccd
