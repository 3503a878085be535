// SPDX-License-Identifier: Apache-2.0
// An upper bound on the distance of two meshes, from a few of their vertices.
#pragma once

#include <cstdint>

#include "bvh/motion_bounds.h"
#include "bvh/tree.h"
#include "traverse/fine_boxes.h"

namespace hpccd {

// The distance of two vertices below two nodes of different meshes, by number, which some pair of their features is no
// farther apart than. Goes down where boxes are nearest, so it is mostly little above the smallest. Infinity where the
// vertices it comes to have no features that are tested against each other.
// `fine`: for scenes in which floats do not distinguish features; otherwise null.
double distance_of_near_corners(const Tree& tree, const MotionBounds& snapshot, const FineBoxes* fine, std::uint32_t a,
                                std::uint32_t b);

}  // namespace hpccd
