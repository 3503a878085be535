// SPDX-License-Identifier: Apache-2.0
// What is told of a contact besides its pair and time, and when its features are looked at for that.
#pragma once

#include "base/vec3.h"

namespace hpccd {

// When the features are looked at for points and directions.
enum class AtTime : bool { contact, start };

struct Outputs {
  bool points, normals, closest;
  AtTime at;
};

struct PairPlaces {
  Vec3<double> point, normal;
  Vec3<double> closest[2];  // on the first feature, on the second
};

}  // namespace hpccd
