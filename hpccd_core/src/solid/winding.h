// SPDX-License-Identifier: Apache-2.0
// Winding numbers of points with respect to closed meshes, exactly: the faces that a ray from the point crosses, with
// their orientation.
#pragma once

#include <cstdint>

#include "base/vec3.h"
#include "bvh/motion_bounds.h"
#include "bvh/tree.h"
#include "scene/features.h"

namespace hpccd {

struct Winding {
  std::int32_t number;  // 0 outside, 1 inside a mesh whose faces are counterclockwise seen from outside; 0 on it
  bool on_surface;
};

// Of a point and a closed mesh in the snapshot to which the tree is fitted. Coordinates up to largest_in_snapshot.
Winding winding_number(const Tree& tree, const MotionBounds& snapshot, const Features& features, std::uint32_t mesh,
                       const Vec3<double>& point);

}  // namespace hpccd
