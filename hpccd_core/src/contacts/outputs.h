// SPDX-License-Identifier: Apache-2.0
// The optional outputs of a contact, and the time at which features are evaluated for them.
#pragma once

#include "base/vec3.h"

namespace hpccd {

// The time at which features are evaluated for points and directions.
enum class AtTime : bool { contact, start };

struct Outputs {
  bool points, normals, closest;
  AtTime at;
};

struct PairPlaces {
  Vec3<double> point, normal;
  Vec3<double> closest[2];  // positions on the first and on the second feature
};

}  // namespace hpccd
