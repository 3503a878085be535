// SPDX-License-Identifier: Apache-2.0
// The coordinates of a query over one power of two for all axes, as Euclidean distances ask for; and a distance.
#pragma once

#include "elementary/exact/integers.h"
#include "elementary/motion.h"

namespace hpccd::exact {

inline double coordinate(const Vec3<double>& v, int k) { return k == 0 ? v.x : k == 1 ? v.y : v.z; }

// Four vertices.
struct Given {
  OddMantissa x[4][3];
  BitRange range;

  explicit Given(const Vec3<double> q[4]) {
    for (int i = 0; i < 4; ++i)
      for (int k = 0; k < 3; ++k) range.include(x[i][k] = OddMantissa(coordinate(q[i], k)));
  }
};

// d = mantissa 2^shift in units of the coordinates' power of two.
struct Margin {
  std::int64_t mantissa;
  int shift;
  Margin(double d, int low) {
    const OddMantissa x(d);
    mantissa = x.mantissa;
    shift = mantissa ? x.exponent - low : 0;
  }
};

}  // namespace hpccd::exact
