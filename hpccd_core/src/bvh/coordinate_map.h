// SPDX-License-Identifier: Apache-2.0
// Centres and scales coordinates before they are rounded to floats, so that boxes stay tight far from the origin and
// at any scale. Subtraction, multiplication by a power of two and rounding to float are monotonic (x <= y implies
// map(x) <= map(y)). Culling needs no more than that to be safe.
#pragma once

#include <math.h>

#include "base/coordinate_limits.h"
#include "base/hd.h"
#include "base/real.h"

namespace hpccd {

struct CoordinateMap {
  double center[3] = {0, 0, 0};
  double scale = 1;

  // Maps the given ranges into [-2.25, 2.25].
  HPCCD_HD static CoordinateMap around(const double low[3], const double high[3]) {
    CoordinateMap m;
    double extent = 0;
    for (int k = 0; k < 3; ++k) {
      m.center[k] = 0.5 * low[k] + 0.5 * high[k];
      extent = greater(0.5 * high[k] - 0.5 * low[k], extent);
    }
    const int exponent = extent > 0 ? ilogb(extent) : 0;
    if (extent > 0) m.scale = ldexp(1.0, exponent < -1000 ? 1000 : exponent > 1000 ? -1000 : -exponent);
    // On a coarse grid, so that a motion inside a large scene does not change the map, nor the boxes of resting meshes.
    // The map depends on the step only, never on previous steps.
    for (int k = 0; k < 3; ++k) {
      const double steps = 4 * (m.center[k] * m.scale);
      if (extent > 0 && fabs(steps) < 1e15) m.center[k] = rint(steps) / 4 / m.scale;
    }
    return m;
  }

  HPCCD_HD double precise(double x, int k) const { return (x - center[k]) * scale; }
  HPCCD_HD float operator()(double x, int k) const { return static_cast<float>(precise(x, k)); }

  bool operator==(const CoordinateMap&) const = default;
};

}  // namespace hpccd
