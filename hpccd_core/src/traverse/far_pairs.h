// SPDX-License-Identifier: Apache-2.0
// Candidate feature pairs of two leaves of different meshes that are far apart compared with their size, in one
// snapshot.
#pragma once

#include "traverse/leaf_pairs.h"

namespace hpccd {

// Like leaf_pairs_in_snapshot(), for leaves that are far apart. For near leaves, boxes grown by `reach` exclude much of
// the other leaf. For far ones they cover it whole, so features are compared along the direction that separates the
// leaves. This costs more than boxes, and a tenth of the test of a pair.
LeafPairsInSnapshot far_pairs(Simd simd);

}  // namespace hpccd
