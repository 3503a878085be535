// SPDX-License-Identifier: Apache-2.0
// Only the earliest contact of a scene: computing all contacts takes too long for a million scenes.
#pragma once

#include <vector>

#include "all_pairs.h"

namespace oracle {

// The earliest time in [0,1] at which two features of a step are within the distance of each other (0: touch), rounded
// down to a double; +inf where they never are.
double earliest_contact(const Meshes& meshes, const std::vector<Point>& t0, const std::vector<Point>& t1,
                        double distance);

}  // namespace oracle
