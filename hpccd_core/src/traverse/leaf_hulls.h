// SPDX-License-Identifier: Apache-2.0
// Decides whether two leaves are certainly farther apart than a distance, by directions that separate all their
// corners.
#pragma once

#include "bvh/tree.h"

namespace hpccd {

// A distance in coordinates of the boxes, rounded up; `rounding` is MotionBounds's. The coordinates are within 2.25 of
// zero and were rounded once to float (coordinate_map.h): 2.4e-7 for two of them, and as much for their difference.
inline float reach_of(double distance, double rounding, double scale) {
  return distance > 0 ? static_cast<float>((distance + rounding) * scale * (1 + 1e-6) + 1e-6) : 0;
}

// Whether boxes grown by this reach cover most of two leaves, so that a closer test is worthwhile.
bool far_apart(const Node& a, const Node& b, float reach);

// Whether two leaves have a vertex in common, as most near leaves of a mesh do: the hulls then touch.
bool share_a_vertex(const Tree& tree, const LeafRange& a, const LeafRange& b);

// In one snapshot, in coordinates of the boxes; `reach` as returned by reach_of(). Axis-aligned boxes of slanted
// features are larger than the features by nearly their own size: of sixty separate spheres, boxes leave 182,000 pairs
// of leaves, this test 13,000.
bool farther_apart(const Tree& tree, const LeafRange& a, const LeafRange& b, float reach);

}  // namespace hpccd
