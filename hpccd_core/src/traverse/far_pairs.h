// SPDX-License-Identifier: Apache-2.0
// Candidate feature pairs of two leaves of different meshes that are far apart compared with their size, in one
// snapshot.
#pragma once

#include "traverse/leaf_pairs.h"

namespace hpccd {

// As leaf_pairs_in_snapshot(), whose boxes tell much where leaves are near: there `reach` cuts a piece from them. Far
// away it covers them whole, and features are compared along the direction in which their boxes are apart. That costs
// more than boxes do, and a tenth of the test of a pair.
LeafPairsInSnapshot far_pairs(Simd simd);

}  // namespace hpccd
