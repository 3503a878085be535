// SPDX-License-Identifier: Apache-2.0
// Converts the nearest pairs of features into the public result of distances().
#pragma once

#include "base/cancellation.h"
#include "elementary/batch.h"
#include "traverse/nearest_pairs.h"

namespace hpccd {

// One gap for each pair, in their order. Throws Cancelled.
std::vector<Gap> collect_gaps(const NearestPairs& nearest, const Geometry& geometry, const Cancellation& cancellation);

}  // namespace hpccd
