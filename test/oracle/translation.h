// SPDX-License-Identifier: Apache-2.0
// Translations that separate two meshes.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "exact_mesh.h"

namespace oracle {

struct OneMesh {
  std::vector<std::array<double, 3>> vertices;
  std::vector<Triangle> faces;
  bool closed;  // whether the other mesh may be inside
};

// The infimum of the s >= 0 for which a, moved by s direction / |direction|, has no point in common with b, and no
// vertex of either is inside the other, closed one; rounded to the nearest double. The direction is not zero.
double separating_translation(const OneMesh& a, const OneMesh& b, const std::array<double, 3>& direction);

// The length of the shortest translation that separates the convex hulls of two sets of points, 0 where they share no
// inner point; rounded to the nearest double. faces: those of the hulls, three corners of each, or more of them.
double convex_depth(const OneMesh& a, const OneMesh& b);

}  // namespace oracle
