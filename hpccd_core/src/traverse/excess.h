// SPDX-License-Identifier: Apache-2.0
// The excess of a pair of meshes: boxes of a mesh grow by half of the largest separation of its pairs; the excess is
// how much more the boxes of two meshes have grown than half of their own separation each. Boxes that overlap by less
// than the excess are too far apart.
#pragma once

#include <algorithm>

#include "bvh/motion_bounds.h"
#include "bvh/tree.h"
#include "scene/separation_table.h"

namespace hpccd {

class Excess {
 public:
  // No excess.
  Excess() = default;
  // The excess is zero if all pairs have one separation, and if gaps of the scene are shortened (squeezed_axis.h): then
  // boxes have grown by less than their separation. The arguments must not change.
  Excess(const MotionBounds& motion, const SeparationTable& separations) {
    if (!motion.grown || separations.uniform() || !motion.squeezed.empty() || motion.thicker_than_scene()) return;
    motion_ = &motion, separations_ = separations.of_pairs();
  }

  bool any() const { return motion_; }
  // In coordinates of the boxes, rounded down. Coordinates are within 6.25 and were rounded to floats, and so are their
  // differences from the excess: errors are 7.2e-7 at most. Within one mesh the excess is less than the width of the
  // box of a vertex, so that a vertex shared by two leaves stays near both.
  float of(std::uint32_t mesh_a, std::uint32_t mesh_b) const {
    if (mesh_a == mixed_meshes || mesh_b == mixed_meshes) return 0;
    const double grown_by = motion_->margin_of_mesh(mesh_a) + motion_->margin_of_mesh(mesh_b);
    const double beyond = grown_by - separations_.of(mesh_a, mesh_b) - motion_->rounding;
    return static_cast<float>(std::max(beyond * motion_->map.scale * (1 - 1e-6) - 2e-6, 0.0));
  }
  float of(const Node& a, const Node& b) const { return any() ? of(a.mesh, b.mesh) : 0; }

 private:
  const MotionBounds* motion_ = nullptr;
  PairValues<double> separations_;
};

}  // namespace hpccd
