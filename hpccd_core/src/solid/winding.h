// SPDX-License-Identifier: Apache-2.0
// Winding numbers of points with respect to closed meshes, exactly: the faces that a ray from the point crosses, with
// their orientation.
#pragma once

#include <cstdint>
#include <span>

#include "base/vec3.h"
#include "bvh/motion_bounds.h"
#include "bvh/placed_meshes.h"
#include "bvh/tree.h"
#include "scene/features.h"
#include "solid/crossing.h"

namespace hpccd {

struct Winding {
  std::int32_t number;  // 0 outside, 1 inside a mesh whose faces are counterclockwise seen from outside; 0 on it
  bool on_surface;
};

// Rays of as many points descend the tree together. The points should be near each other: 100,000 points near a mesh of
// 100,000 triangles take a third of the time that they take one by one.
inline constexpr std::size_t points_at_once = 16;

// Of at most points_at_once points and a closed mesh in the snapshot to which the tree is fitted, or of the meshes of
// the tree at poses, if `placed` is not null. Coordinates up to largest_in_snapshot.
void winding_numbers(const Tree& tree, const MotionBounds& snapshot, const Features& features, std::uint32_t mesh,
                     std::span<const Vec3<double>> points, std::span<Winding> found,
                     const PlacedMeshes* placed = nullptr);
// Of a point and a closed mesh in the snapshot to which the tree is fitted. Coordinates up to largest_in_snapshot.
Winding winding_number(const Tree& tree, const MotionBounds& snapshot, const Features& features, std::uint32_t mesh,
                       const Vec3<double>& point);

namespace exact {
// solid/crossing.h in integers, certain for all points and corners.
Crossing crossing(const Vec3<double> q[4]);
}  // namespace exact

}  // namespace hpccd
