// SPDX-License-Identifier: Apache-2.0
// One mesh in the snapshot to which the tree of all meshes is fitted.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "base/vec3.h"
#include "bvh/motion_bounds.h"
#include "bvh/tree.h"
#include "scene/features.h"

namespace hpccd {

struct MeshInTree {
  const Tree& tree;
  const MotionBounds& snapshot;
  const Features& features;
  std::uint32_t mesh;

  bool may_be_below(const Node& node) const { return node.mesh == mesh || node.mesh == mixed_meshes; }
  Vec3<double> position(std::uint32_t vertex) const {
    const double* x = snapshot.vertices[vertex].t0;
    return {x[0], x[1], x[2]};
  }
  // A point in the coordinates of the boxes. Far outside the scene, the order is kept where floats end.
  std::array<float, 3> mapped(const Vec3<double>& point) const {
    const double x[3] = {point.x, point.y, point.z};
    std::array<float, 3> at;
    for (int k = 0; k < 3; ++k) {
      if (snapshot.squeezed.empty())
        at[k] = static_cast<float>(std::clamp(snapshot.map.precise(x[k], k), -1e30, 1e30));
      else
        at[k] = snapshot.squeezed[static_cast<std::size_t>(k)](x[k]);
    }
    return at;
  }
};

}  // namespace hpccd
