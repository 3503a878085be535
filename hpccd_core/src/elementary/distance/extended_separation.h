// SPDX-License-Identifier: Apache-2.0
// The separation test once more with 106 bits: for what double precision leaves undecided, because features approach
// each other slowly or pass each other at a distance very near the separation.
#pragma once

#include "elementary/distance/separation_test.h"
#include "elementary/extended_precision.h"

namespace hpccd::extended_precision {

template <Kind kind>
HPCCD_HD Answer earliest_within(const Vec3<double> q_t0[4], const Vec3<double> q_t1[4], double d) {
  const Outcome<DoubleDouble> o = separation_test<kind>(motion_of<kind>(q_t0, q_t1), DoubleDouble(d));
  return {o.contact, o.none, rounded_towards_zero(o.toc)};
}

}  // namespace hpccd::extended_precision
