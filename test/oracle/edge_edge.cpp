// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "elementary.h"
#include "motion.h"
#include "origin_in_triangle.h"

namespace oracle {

// Two segments share a point where the parallelogram of all differences of their points contains the origin.
// A diagonal cuts it into two triangles, also where it is flat.
std::optional<double> edge_edge(const Query& query) {
  const auto [a0, a1, b0, b1] = motion(query);
  const auto first = origin_in_triangle(a0 - b0, a1 - b0, a1 - b1);
  const auto second = origin_in_triangle(a0 - b0, a0 - b1, a1 - b1);
  return first && second ? std::min(*first, *second) : first ? first : second;
}

}  // namespace oracle
