// SPDX-License-Identifier: Apache-2.0
// The optional outputs of a contact, and the time at which features are evaluated for them.
#pragma once

#include "base/vec3.h"
#include "hpccd/options.h"

namespace hpccd {

// The time at which features are evaluated for points and directions.
enum class AtTime : bool { contact, start };

struct Outputs {
  bool points, normals, closest, weights;  // weights: with vertices, and with the approach at the time of contact
  AtTime at;

  static Outputs of_contacts(const Options& o) { return {o.points, o.normals, o.closest, o.weights, AtTime::contact}; }
  static Outputs of_proximity(const Options& o) { return {false, o.normals, o.closest, o.weights, AtTime::start}; }
  bool any() const { return points || normals || closest || weights; }
};

struct PairPlaces {
  Vec3<double> point, normal;
  Vec3<double> closest[2];  // positions on the first and on the second feature
  double weights[4];
  double approach;
};

}  // namespace hpccd
