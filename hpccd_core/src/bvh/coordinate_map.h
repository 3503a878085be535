// SPDX-License-Identifier: Apache-2.0
// Centres and scales coordinates before they become floats, so that boxes stay sharp far from the origin and at any
// scale. Subtraction, multiplication by a power of two and rounding to float all keep the order of numbers (x <= y
// implies map(x) <= map(y)), which is all that culling needs to be safe.
#pragma once

#include <cmath>

#include "bvh/box.h"

namespace hpccd {

struct CoordinateMap {
  double center[3] = {0, 0, 0};
  double scale = 1;

  // Maps the given ranges to about [-1, 1].
  static CoordinateMap around(const double low[3], const double high[3]) {
    CoordinateMap m;
    double extent = 0;
    for (int k = 0; k < 3; ++k) {
      m.center[k] = 0.5 * low[k] + 0.5 * high[k];
      extent = std::max(extent, 0.5 * high[k] - 0.5 * low[k]);
    }
    if (extent > 0) m.scale = std::ldexp(1.0, -std::clamp(std::ilogb(extent), -1000, 1000));
    return m;
  }

  float operator()(double x, int k) const { return static_cast<float>((x - center[k]) * scale); }

  bool operator==(const CoordinateMap&) const = default;
};

}  // namespace hpccd
