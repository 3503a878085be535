// SPDX-License-Identifier: Apache-2.0
// Decides whether two leaves are certainly farther apart than a distance, by directions that separate all their
// corners.
#pragma once

#include "bvh/tree.h"

namespace hpccd {

// A distance in the coordinates of the boxes, rounded up; `rounding` as MotionBounds has it. These lie within 2.25 of
// zero and were rounded once to a float (coordinate_map.h): 2.4e-7 for two of them, and as much for their difference.
inline float reach_of(double distance, double rounding, double scale) {
  return distance > 0 ? static_cast<float>((distance + rounding) * scale * (1 + 1e-6) + 1e-6) : 0;
}

// Whether boxes of this reach cover most of two leaves, so that looking closer pays.
bool far_apart(const Node& a, const Node& b, float reach);

// In one snapshot, in coordinates of the boxes; `reach` as reach_of() has it. Boxes along the axes
// stand off from what is slanted to them by nearly their own size: of sixty spheres that are apart, boxes leave 182,000
// pairs of leaves, and this 13,000.
bool farther_apart(const Tree& tree, const LeafRange& a, const LeafRange& b, float reach);

}  // namespace hpccd
