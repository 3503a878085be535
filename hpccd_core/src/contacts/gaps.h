// SPDX-License-Identifier: Apache-2.0
// From the nearest pairs of features to the public result.
#pragma once

#include "elementary/batch.h"
#include "traverse/nearest_pairs.h"
#include "traverse/tasks.h"

namespace hpccd {

// One for each enabled pair of meshes, by (mesh_a, mesh_b), mesh_a <= mesh_b.
std::vector<Gap> collect_gaps(const Scene& scene, const PairRules& rules, const NearestPairs& nearest,
                              const Geometry& geometry);

}  // namespace hpccd
