// SPDX-License-Identifier: Apache-2.0
// For instruction sets that have no instruction for it.
#pragma once

#include <cstdint>

#include "base/hd.h"

namespace hpccd {

// Appends the pairs of `number` with those of `others` that are in `lanes` to first[n], second[n]; ascending: the lower
// number of each pair comes first.
template <bool ascending>
HPCCD_HD void append_one_by_one(std::uint32_t* first, std::uint32_t* second, std::uint32_t& n, std::uint32_t number,
                                const std::uint32_t* others, unsigned lanes) {
  for (; lanes; lanes &= lanes - 1) {
    const std::uint32_t other = others[__builtin_ctz(lanes)];
    const bool swapped = ascending && other < number;
    first[n] = swapped ? other : number;
    second[n++] = swapped ? number : other;
  }
}

}  // namespace hpccd
