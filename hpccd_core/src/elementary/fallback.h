// SPDX-License-Identifier: Apache-2.0
// The fallback of each tier for queries that the error bounds leave undecided.
#pragma once

#include <cstdint>
#include <optional>

#include "elementary/motion.h"
#include "hpccd/hpccd.h"

namespace hpccd {

// Counts of pairs by the stage that decided them.
struct FallbackCounts {
  std::uint64_t tolerance = 0;  // "balanced", "fast": double precision with a tolerance
  std::uint64_t extended = 0;   // 106 bits
  std::uint64_t integers = 0;   // exact arithmetic
};

// A pair and the positions of its vertices at both ends of the step; q[0..3] as in motion.h.
struct UndecidedPair {
  Kind kind;
  Vec3<double> t0[4], t1[4];
  double separation;       // for tests with a separation
  double apart_until = 0;  // the time up to which a previous test has shown the features to be farther apart than the
                           // separation; 0: unknown
};

// Returns the time of contact, or the distance, or nothing.
using Fallback = std::optional<double> (*)(Accuracy, const UndecidedPair&, FallbackCounts&);

std::optional<double> decide_contact(Accuracy accuracy, const UndecidedPair& pair, FallbackCounts& counts);
// The earliest time within a separation above 0. Here and below undecided pairs are rare, so all tiers decide exactly.
std::optional<double> decide_separation(Accuracy accuracy, const UndecidedPair& pair, FallbackCounts& counts);
// For t0 only: the distance, if it is at most the separation.
std::optional<double> decide_proximity(Accuracy accuracy, const UndecidedPair& pair, FallbackCounts& counts);

}  // namespace hpccd
