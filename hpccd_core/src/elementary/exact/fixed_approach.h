// SPDX-License-Identifier: Apache-2.0
// The side from which features approach each other, in integers of one and two limbs. On CPUs and devices.
#pragma once

#include "elementary/exact/approach.h"
#include "elementary/exact/given_motion.h"

namespace hpccd::exact {

// Nothing if integers of any size are needed.
HPCCD_HOST_DEVICE inline std::optional<Approach> fixed_approach(Kind kind, const GivenMotion& given, double toc) {
  if (given.bits <= Widths<Integer<1>>::coordinate_bits) return approach(given.query<Integer<1>>(kind), given.low, toc);
  if (given.bits <= Widths<Integer<2>>::coordinate_bits) return approach(given.query<Integer<2>>(kind), given.low, toc);
  return std::nullopt;
}

}  // namespace hpccd::exact
