// SPDX-License-Identifier: Apache-2.0
// The coordinates of a query at both ends of the step, before their conversion to integers.
#pragma once

#include <algorithm>

#include "elementary/exact/boxes.h"
#include "elementary/exact/query.h"

namespace hpccd::exact {

// The coordinates of a query, by axis, and the power of two that makes each axis integers.
struct GivenMotion {
  OddMantissa begin[3][4], end[3][4];
  int low[3], bits = 1;

  HPCCD_HOST_DEVICE GivenMotion(const Vec3<double> q_t0[4], const Vec3<double> q_t1[4]) {
    for (int k = 0; k < 3; ++k) {
      BitRange range;
      for (int i = 0; i < 4; ++i) {
        range.include(begin[k][i] = OddMantissa(coordinate(q_t0[i], k)));
        range.include(end[k][i] = OddMantissa(coordinate(q_t1[i], k)));
      }
      low[k] = range.low;
      bits = std::max(bits, range.bits());
    }
  }

  template <class Z>
  HPCCD_HOST_DEVICE Query<Z> query(Kind kind) const {
    Coordinates<Z> points[4];
    for (int i = 0; i < 4; ++i)
      for (int k = 0; k < 3; ++k) {
        const Z z0 = scaled_integer<Z>(begin[k][i], low[k]), z1 = scaled_integer<Z>(end[k][i], low[k]);
        points[i][k] = {{z0, z1 - z0}};
      }
    return {kind, points};
  }
};

}  // namespace hpccd::exact
