// SPDX-License-Identifier: Apache-2.0
// Replacements for instructions that an instruction set lacks.
#pragma once

#include <cstdint>

#include "base/hd.h"

namespace hpccd {

// Sixteen numbers in memory.
struct NumbersInMemory {
  const std::uint32_t* at;
};

// Appends the pairs of `number` with those of `others` that are in `lanes` to first[n], second[n], which must have room
// for sixteen.
HPCCD_HD void append_pairs(std::uint32_t* first, std::uint32_t* second, std::uint32_t& n, std::uint32_t number,
                           const NumbersInMemory& others, unsigned lanes) {
  for (; lanes; lanes &= lanes - 1) {
    first[n] = number;
    second[n++] = others.at[__builtin_ctz(lanes)];
  }
}

}  // namespace hpccd
