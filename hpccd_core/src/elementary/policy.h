// SPDX-License-Identifier: Apache-2.0
// How certain a decision of the floating-point tests must be, and which time of impact a tier reports.
#pragma once

#include "base/real.h"
#include "hpccd/hpccd.h"

namespace hpccd {

// Of a proven contact whose true time lies within delta of toc: "conservative" promises never to be late.
HPCCD_HD double reported_time(Accuracy accuracy, double toc, double delta) {
  return accuracy == Accuracy::conservative ? greater(toc - delta, 0.0) : toc;
}

// Times of one step that are as far apart may be reported as equal, or in the other order.
inline constexpr double same_time = 2e-12;

// By the bounds of worst-case rounding. A time of contact is accepted only where it is known to 9e-13: the contract
// promises 1e-12.
struct Proven {
  static constexpr double bound = 1, border = 1, toc_radius = 9e-13, time_step = 0;
  static constexpr bool borders_inside = false, trust_roots = false;
};

// In single precision before a test in double precision: what has one root by twice the bounds has one by the bounds of
// the latter too, which are a million times as sharp.
struct Sieve : Proven {
  static constexpr double bound = 2;
};

// For the tier that promises nothing: borders count as inside, as far as typical rounding reaches, a sixteenth of the
// bounds, and a time is taken as it comes where Newton's method moves it by less than time_step. But whether there is a
// root is a matter of the bounds: by less, half as many contacts again were invented on the published cloth-funnel
// step.
struct Likely {
  static constexpr double bound = 1, border = 1.0 / 16, toc_radius = 1, time_step = 2e-5;
  static constexpr bool borders_inside = true, trust_roots = true;
};

}  // namespace hpccd
