// SPDX-License-Identifier: Apache-2.0
#include "base/machine_rate.h"

#include <gtest/gtest.h>

namespace hpccd {
namespace {

TEST(MachineRate, EveryInstructionSetHasAllRates) {
  for (const Simd simd : simd_levels())
    for (const Rate rate : {Rate::comparisons, Rate::floats, Rate::doubles, Rate::read, Rate::copy})
      EXPECT_GT(machine_rate(rate, simd, 2, 1 << 16), 1e6);
}

TEST(MachineRate, LittleDataIsEnough) { EXPECT_GT(machine_rate(Rate::copy, Simd::automatic, 1, 0), 1e6); }

}  // namespace
}  // namespace hpccd
