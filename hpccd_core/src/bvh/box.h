// SPDX-License-Identifier: Apache-2.0
// Axis-aligned boxes of the motion, in single precision. Coordinates enter by one map that never reverses their order
// (see coordinate_map.h), and boxes only take minima and maxima of mapped coordinates: features that touch have boxes
// that overlap, without any rounding outwards.
#pragma once

#include <algorithm>
#include <limits>

namespace hpccd {

struct Box {
  float low[3] = {inf, inf, inf};
  float high[3] = {-inf, -inf, -inf};

  void include(const Box& b) {
    for (int k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], b.low[k]);
      high[k] = std::max(high[k], b.high[k]);
    }
  }
  bool overlaps(const Box& b) const {
    return (low[0] <= b.high[0]) & (b.low[0] <= high[0]) & (low[1] <= b.high[1]) & (b.low[1] <= high[1]) &
           (low[2] <= b.high[2]) & (b.low[2] <= high[2]);
  }
  float half_area() const {
    const float x = high[0] - low[0], y = high[1] - low[1], z = high[2] - low[2];
    return x * y + y * z + z * x;
  }

  static constexpr float inf = std::numeric_limits<float>::infinity();
};

}  // namespace hpccd
