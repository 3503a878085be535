// SPDX-License-Identifier: Apache-2.0
// The coordinates of a query times one power of two for all axes, as Euclidean distances require; and a distance.
#pragma once

#include "elementary/exact/boxes.h"
#include "elementary/exact/integers.h"

namespace hpccd::exact {

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
