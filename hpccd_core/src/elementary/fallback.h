// SPDX-License-Identifier: Apache-2.0
// What a tier does with a query that the error bounds could not decide.
#pragma once

#include <cstdint>
#include <optional>

#include "elementary/inclusion.h"
#include "elementary/motion.h"
#include "hpccd/hpccd.h"

namespace hpccd {

// Who decided, at the end.
struct FallbackCounts {
  std::uint64_t tolerance = 0;  // "balanced", "fast": double precision with a tolerance
  std::uint64_t integers = 0;   // exact arithmetic
  std::uint64_t inclusion = 0;  // "conservative" with a separation: the search
};

// q[0..3] as in motion.h; the limits matter to "conservative" only. The time of contact, or nothing.
std::optional<double> decide_undecided(Accuracy accuracy, const inclusion::Limits& limits, Kind kind,
                                       const Vec3<double> q_t0[4], const Vec3<double> q_t1[4], FallbackCounts& counts);

}  // namespace hpccd
