// SPDX-License-Identifier: Apache-2.0
// Rigid motions, bit-identical to hpccd_core/rigid/transform.py, on GPUs too; sums are evaluated in its order.
#pragma once

#include <cmath>

#include "base/hd.h"
#include "base/vec3.h"

namespace hpccd::rigid {

using Vector = Vec3<double>;

// A rotation, of length 1.
struct Quaternion {
  double x = 0, y = 0, z = 0, w = 1;
};

// The rows of a matrix.
struct Rotation {
  Vector first, second, third;
};

// x -> rotation x + translation.
struct Pose {
  Quaternion turn;
  Vector shift{0, 0, 0};
};

// The rotation of b, followed by that of a.
inline Quaternion product(const Quaternion& a, const Quaternion& b) {
  const Quaternion unscaled{
      a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y, a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
      a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w, a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z};
  const double length =
      std::sqrt(unscaled.x * unscaled.x + unscaled.y * unscaled.y + unscaled.z * unscaled.z + unscaled.w * unscaled.w);
  return {unscaled.x / length, unscaled.y / length, unscaled.z / length, unscaled.w / length};
}

inline Rotation rotation_of(const Quaternion& q) {
  const auto [x, y, z, w] = q;
  return {{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
          {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
          {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}};
}

HPCCD_HD Vector rotated(const Rotation& by, const Vector& v) {
  return {v.x * by.first.x + v.y * by.first.y + v.z * by.first.z,
          v.x * by.second.x + v.y * by.second.y + v.z * by.second.z,
          v.x * by.third.x + v.y * by.third.y + v.z * by.third.z};
}

// `first`, followed by `then`.
inline Pose after(const Pose& then, const Pose& first) {
  return {product(then.turn, first.turn), rotated(rotation_of(then.turn), first.shift) + then.shift};
}

inline bool any(const Vector& v) { return v.x != 0 || v.y != 0 || v.z != 0; }

// Applies a pose to points. Without a rotation coordinates are only shifted, and without a translation as well they
// stay unchanged: a product with 1 and sums with 0 could change the sign of a zero.
class Placing {
 public:
  explicit Placing(const Pose& pose)
      : turns_(any({pose.turn.x, pose.turn.y, pose.turn.z})),
        shifts_(any(pose.shift)),
        rotation_(rotation_of(pose.turn)),
        shift_(pose.shift) {}

  HPCCD_HD Vector operator()(const Vector& v) const {
    if (turns_) return rotated(rotation_, v) + shift_;
    return shifts_ ? v + shift_ : v;
  }

 private:
  bool turns_, shifts_;
  Rotation rotation_;
  Vector shift_;
};

}  // namespace hpccd::rigid
