// SPDX-License-Identifier: Apache-2.0
// Operations on one real number, with the names that lanes.h gives them for several at once.
#pragma once

#include <math.h>

#include "base/hd.h"

namespace hpccd {

HPCCD_HD double select(bool m, double a, double b) { return m ? a : b; }
HPCCD_HD float select(bool m, float a, float b) { return m ? a : b; }
HPCCD_HD bool any(bool m) { return m; }
HPCCD_HD unsigned bits(bool m) { return m ? 1u : 0u; }
HPCCD_HD double square_root(double x) { return sqrt(x); }
HPCCD_HD float square_root(float x) { return sqrtf(x); }

// Properties of a lane type: the number of lanes, the scalar, and a constant in every lane.
template <class R>
struct RealTraits;
template <>
struct RealTraits<double> {
  using Scalar = double;
  using Mask = bool;
  static constexpr int width = 1;
};
template <>
struct RealTraits<float> {
  using Scalar = float;
  using Mask = bool;
  static constexpr int width = 1;
};

// Written with select so that every backend is bit-identical, also for -0 and NaN.
template <class R>
HPCCD_HD R lesser(R a, R b) {
  return select(a < b, a, b);
}
template <class R>
HPCCD_HD R greater(R a, R b) {
  return select(a > b, a, b);
}
template <class R>
HPCCD_HD R magnitude(R a) {
  return select(a < R(0), R(0) - a, a);
}
// Drops the sign of zero like the lanes, so that one float is bit-identical to a float in a lane.
HPCCD_HD float magnitude(float a) { return fabsf(a); }

}  // namespace hpccd
