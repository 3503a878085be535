// SPDX-License-Identifier: Apache-2.0
// The loops behind machine_rate.h, one set for each instruction set.
#pragma once

#include <cstddef>
#include <cstdint>

namespace hpccd {

inline constexpr int compared_rows = 64, computed_chains = 12;

// Runs the loop so often over n floats, aligned to 64 bytes. What it returns has no meaning, but must be used.
using RateKernel = double (*)(const float* data, std::size_t n, std::uint64_t repeats);

struct RateKernels {
  RateKernel compare, floats, doubles, read;
  int float_operations, double_operations;  // in one repeat
};

}  // namespace hpccd
