// SPDX-License-Identifier: Apache-2.0
// Bounds on the rounding errors of computed distances.
#pragma once

#include "elementary/coplanarity.h"

namespace hpccd {

// A gap along a direction with a computed value above `above` is certainly more than d; a distance of two points with a
// computed value of at most `below` is certainly at most d.
//
// With S = |p| + |a| + |b| (largest coordinates of the step) and u half an ulp of one: a direction has length at most 1
// + 4 u. A corner's gap along it is the sum of three dot products with vectors whose coordinates were rounded once: at
// most 6 rounding errors of at most sqrt(3) S, 11 u S. Its value at a time adds three (6 u S), the time at which it
// falls to a limit another three (6 u S): 23 u S. The coordinates of the gap between two points at a time have 8
// rounding errors of S, and an inexact position as much again: 28 u S. Relative to d: the direction's length and the
// products with d, 8 u. The rest covers second-order terms and the rounding of these limits.
template <class R>
struct Margins {
  R above, below;
};

template <class R>
HPCCD_HD R extent(const Magnitudes<R>& size) {
  return size.p + size.a + size.b;
}

template <class R>
HPCCD_HD Margins<R> margins(R d, R s) {
  const R u(half_ulp<R>());
  return {d + R(12) * (u * d) + R(32) * (u * s), d - R(12) * (u * d) - R(32) * (u * s)};
}

// The square of a distance between two points; its rounding errors are among those relative to d.
template <class R>
HPCCD_HD typename RealTraits<R>::Mask is_within(R square, const Margins<R>& margin) {
  return margin.below > R(0) && square <= margin.below * margin.below;
}

// Whether squares and products of two squares neither overflow nor lose significant bits compared with s.
template <class R>
HPCCD_HD typename RealTraits<R>::Mask squares_in_range(R s) {
  return s >= R(1.6e-60) && s <= R(1.6e60);  // 2^-199, 2^200
}

// A direction needs a square without lost bits, here compared with squares of about s^2, which is in range.
template <class R>
HPCCD_HD typename RealTraits<R>::Mask has_direction(R square, R s) {
  return square > R(1e-28) * (s * s);
}

}  // namespace hpccd
