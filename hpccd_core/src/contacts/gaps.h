// SPDX-License-Identifier: Apache-2.0
// Converts the nearest pairs of features into the public result of distances().
#pragma once

#include "base/cancellation.h"
#include "elementary/batch.h"
#include "traverse/nearest_pairs.h"

namespace hpccd {

// The gap of two meshes. `at`: the positions of the pair's vertices, in the order of the elementary tests. Of the
// geometry, positions are not read.
Gap gap_of(std::array<std::uint32_t, 2> meshes, const NearestPair& found, const Vec3<double> at[5], const Geometry& g);

// One gap for each pair, in their order. Throws Cancelled.
std::vector<Gap> collect_gaps(const NearestPairs& nearest, const Geometry& geometry, const Cancellation& cancellation);

}  // namespace hpccd
