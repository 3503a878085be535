// SPDX-License-Identifier: Apache-2.0
// Takes the caller's positions in: checks them, keeps both ends of each vertex's motion together, bounds the motion.
#pragma once

#include <vector>

#include "base/parallel.h"
#include "bvh/box.h"
#include "bvh/coordinate_map.h"
#include "elementary/batch.h"

namespace hpccd {

// Beyond this, differences and squares of coordinates could overflow in the error bounds.
inline constexpr double largest_coordinate = 1e150;

struct MotionBounds {
  std::vector<VertexRow> rows;
  std::vector<Box> boxes;
  CoordinateMap map;

  // Boxes of features that come within `separation` of each other, along each axis, overlap too.
  // Throws InvalidArgument where a coordinate is not finite or too large.
  void take(Positions vertices_t0, Positions vertices_t1, double separation, ThreadPool& pool);
};

}  // namespace hpccd
