// SPDX-License-Identifier: Apache-2.0
// How certain a decision of the floating-point tests must be, and which time of impact a tier reports.
#pragma once

#include "base/real.h"
#include "hpccd/hpccd.h"

namespace hpccd {

// The reported time of a proven contact whose true time is within delta of toc: "conservative" promises that it is
// never late.
HPCCD_HD double reported_time(Accuracy accuracy, double toc, double delta) {
  return accuracy == Accuracy::conservative ? greater(toc - delta, 0.0) : toc;
}

// Times of one step that differ by less than this may be reported as equal, or in reverse order.
inline constexpr double same_time = 2e-12;

// Proven bounds on rounding errors. A time of contact is accepted only if it is known to 9e-13: the contract promises
// 1e-12.
struct Proven {
  static constexpr double bound = 1, border = 1, toc_radius = 9e-13, time_step = 0;
  static constexpr bool borders_inside = false, trust_roots = false;
};

// Single precision before a test in double precision: a cubic with one root by twice these bounds also has one by the
// bounds of double precision, which are a million times as sharp.
struct Sieve : Proven {
  static constexpr double bound = 2;
};

// For the tier without a promise: borders count as inside within typical rounding errors, a sixteenth of the bounds,
// and a time is accepted if Newton's method changes it by less than time_step. Whether there is a root is still decided
// by the full bounds: with smaller ones the published cloth-funnel step had half as many false positives as contacts.
struct Likely {
  static constexpr double bound = 1, border = 1.0 / 16, toc_radius = 1, time_step = 2e-5;
  static constexpr bool borders_inside = true, trust_roots = true;
};

}  // namespace hpccd
