// SPDX-License-Identifier: Apache-2.0
// An upper bound on the distance of two meshes, from a few of their vertices.
#pragma once

#include <cstdint>

#include "bvh/motion_bounds.h"
#include "bvh/placed_meshes.h"
#include "bvh/tree.h"
#include "scene/feature_filter.h"
#include "traverse/fine_boxes.h"

namespace hpccd {

// The distance of two vertices below two nodes (by number) of different meshes: an upper bound on the smallest distance
// of their features. Descends to the nearest boxes, so the bound is mostly tight. Infinity if the vertices that it
// reaches have no features that are tested against each other. `fine`: for scenes in which floats do not distinguish
// features; otherwise null. `placed`: the meshes if they are at poses, otherwise null. `filter`: of the two meshes, or
// null.
double distance_of_near_corners(const Tree& tree, const MotionBounds& snapshot, const FineBoxes* fine,
                                const PlacedMeshes* placed, const FilterView* filter, std::uint32_t a, std::uint32_t b);

}  // namespace hpccd
