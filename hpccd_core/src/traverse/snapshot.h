// SPDX-License-Identifier: Apache-2.0
// Which boxes count in queries of one snapshot.
#pragma once

#include "bvh/tree.h"
#include "traverse/tasks.h"

namespace hpccd {

// A distance in the coordinates of the boxes, rounded up; `rounding` as MotionBounds has it. These lie within 2.25 of
// zero and were rounded once to a float (coordinate_map.h): 2.4e-7 for two of them, and as much for their difference.
inline float reach_of(double distance, double rounding, double scale) {
  return distance > 0 ? static_cast<float>((distance + rounding) * scale * (1 + 1e-6) + 1e-6) : 0;
}

struct SnapshotBoxes {
  using Ends = AtLeaves;
  static constexpr bool shrink = false;
  float reach;
  bool overlap(const Node& a, const Node& b) const { return a.near_in_snapshot(b, reach); }
  bool within(const Node&) const { return true; }
};

}  // namespace hpccd
