// SPDX-License-Identifier: Apache-2.0
// Queries on small numbers, in which degenerate features, ties and exact distances are common.
#pragma once

#include <random>

#include "elementary/motion.h"

namespace hpccd::exact {

// Integers of at most `most` times the unit.
inline void random_points(std::mt19937_64& random, int most, double unit, Vec3<double> q[4]) {
  const auto number = [&] { return unit * (static_cast<int>(random() % (2 * most + 1)) - most); };
  for (int i = 0; i < 4; ++i) q[i] = {number(), number(), number()};
  if (random() % 8 == 0) q[3] = q[2];
  if (random() % 8 == 0) q[1] = q[0];
  if (random() % 8 == 0) q[3] = q[2] + (q[1] - q[0]);
}

inline Kind random_kind(std::mt19937_64& random) { return random() % 2 ? Kind::vertex_face : Kind::edge_edge; }

}  // namespace hpccd::exact
