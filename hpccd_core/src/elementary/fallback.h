// SPDX-License-Identifier: Apache-2.0
// The fallback of each tier for queries that the error bounds leave undecided.
#pragma once

#include <cstdint>
#include <optional>

#include "elementary/motion.h"
#include "hpccd/hpccd.h"

namespace hpccd {

// Who decided, at the end.
struct FallbackCounts {
  std::uint64_t tolerance = 0;  // "balanced", "fast": double precision with a tolerance
  std::uint64_t extended = 0;   // twice the precision
  std::uint64_t integers = 0;   // exact arithmetic
};

// A pair and where its vertices are at both ends of the step; q[0..3] as in motion.h.
struct UndecidedPair {
  Kind kind;
  Vec3<double> t0[4], t1[4];
  double separation;       // where the test has one
  double apart_until = 0;  // farther apart than that up to here, by the test that left the pair undecided; 0: not known
};

// The time of contact, or the distance, or nothing.
using Fallback = std::optional<double> (*)(Accuracy, const UndecidedPair&, FallbackCounts&);

std::optional<double> decide_contact(Accuracy accuracy, const UndecidedPair& pair, FallbackCounts& counts);
// The earliest time within a separation above 0. Here and below what stays open is rare: no tier gains by a guess.
std::optional<double> decide_separation(Accuracy accuracy, const UndecidedPair& pair, FallbackCounts& counts);
// Of t0 alone: the distance, where it is no larger than the separation.
std::optional<double> decide_proximity(Accuracy accuracy, const UndecidedPair& pair, FallbackCounts& counts);

}  // namespace hpccd
