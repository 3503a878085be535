// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "exact_mesh.h"

namespace oracle {

// The least and the greatest u with u * direction in the convex hull of the points; none where the line misses it.
// The direction is not zero; points may coincide or be on one line or plane.
std::optional<std::pair<Fraction, Fraction>> line_in_hull(const std::vector<Corner>& points,
                                                          const Vec<Integer>& direction);

}  // namespace oracle
