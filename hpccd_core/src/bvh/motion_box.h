// SPDX-License-Identifier: Apache-2.0
// Bounds of a motion at both of its ends. Vertices move on straight lines, so a feature stays inside the boxes that
// move linearly from one end to the other: the maximum of linear functions is below the chord of its values at the
// ends, and the minimum is above. Two features in the same order along an axis at t = 0 and at t = 1 are therefore
// separated along it throughout, however far they move together. Boxes of the whole sweep (bvh/box.h), which the
// published methods use, overlap in that case. On the published cloth-ball step sweep boxes leave 6.9 million pairs of
// features, these boxes 1.8 million; where a step moves farther than the size of a triangle, forty times fewer.
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/hd.h"
#include "bvh/box.h"

namespace hpccd {

struct MotionBox {
  Box t0, t1;

  void include(const MotionBox& b) {
    t0.include(b.t0);
    t1.include(b.t1);
  }
  bool overlaps(const MotionBox& b) const {
    bool apart = false;
    for (int k = 0; k < 3; ++k)
      apart |= (int{t0.high[k] < b.t0.low[k]} & int{t1.high[k] < b.t1.low[k]}) |
               (int{b.t0.high[k] < t0.low[k]} & int{b.t1.high[k] < t1.low[k]});
    return !apart;
  }
  // The mean of both ends, times two.
  float area() const { return t0.half_area() + t1.half_area(); }
  Box swept() const {
    Box whole = t0;
    whole.include(t1);
    return whole;
  }
};

// The order of the twelve bounds wherever they are stored separately: low and high at t = 0, low and high at t = 1,
// each along x, y and z.
inline constexpr std::uint32_t n_bounds = 12;
enum class Side : std::uint32_t { low, high };
HPCCD_HD constexpr std::uint32_t bound_number(std::uint32_t end, Side side, std::uint32_t axis) {
  return 6 * end + 3 * static_cast<std::uint32_t>(side) + axis;
}
HPCCD_HD constexpr Side side_of_bound(std::uint32_t number) { return number / 3 % 2 == 0 ? Side::low : Side::high; }
static_assert(sizeof(MotionBox) == n_bounds * sizeof(float) &&
              offsetof(Box, high) == bound_number(0, Side::high, 0) * sizeof(float) &&
              offsetof(MotionBox, t1) == bound_number(1, Side::low, 0) * sizeof(float));

}  // namespace hpccd
