// SPDX-License-Identifier: Apache-2.0
// Distance tests on a batch of candidate pairs, in the lanes of one instruction set (batch.h).
#pragma once

#include "elementary/batch.h"

namespace hpccd {

// The earliest time at which features come within their separation (Geometry::separations), which is above 0.
BatchTest separation_batch(Simd simd);

// For one snapshot, the vertices' t0: whether features are within the separation. Returns their distance in place of a
// time.
BatchTest proximity_batch(Simd simd);

}  // namespace hpccd
