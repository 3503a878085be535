// SPDX-License-Identifier: Apache-2.0
// Whether two leaves are certainly farther apart than a distance: by directions along which all their corners are.
#pragma once

#include "bvh/tree.h"

namespace hpccd {

// Whether boxes of this reach cover most of two leaves, so that looking closer pays.
bool far_apart(const Node& a, const Node& b, float reach);

// In one snapshot, in coordinates of the boxes; `reach` as reach_of() in snapshot.h has it. Boxes along the axes stand
// off from what is slanted to them by nearly their own size: of sixty spheres that are apart, boxes leave 182,000 pairs
// of leaves, and this 13,000.
bool farther_apart(const Tree& tree, const LeafRange& a, const LeafRange& b, float reach);

}  // namespace hpccd
