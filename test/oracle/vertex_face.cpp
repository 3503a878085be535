// SPDX-License-Identifier: Apache-2.0
#include "elementary.h"
#include "motion.h"
#include "origin_in_triangle.h"

namespace oracle {

std::optional<double> vertex_face(const Query& query) {
  const auto [v, f0, f1, f2] = motion(query);
  return origin_in_triangle(f0 - v, f1 - v, f2 - v);
}

}  // namespace oracle
