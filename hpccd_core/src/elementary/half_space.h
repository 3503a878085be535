// SPDX-License-Identifier: Apache-2.0
// A vertex against the half-space normal . x >= offset. The vertex is within a separation s of everything outside if
// normal . x - offset <= s |normal|. In a motion, the left side is linear in time: it is least at one of both ends.
#pragma once

#include <cmath>
#include <optional>

#include "base/vec3.h"
#include "hpccd/scene.h"

namespace hpccd {

class HalfSpace {
 public:
  HalfSpace(const Plane& plane, double separation);

  // Certainly farther than the separation. False for many that are undecided.
  bool apart(double x, double y, double z) const {
    const double a = normal_.x * x, b = normal_.y * y, c = normal_.z * z;
    return a + b + c - offset_ - relative_ * (std::fabs(a) + std::fabs(b) + std::fabs(c)) > far_;
  }
  // The same for planes across coordinate axis(), from one coordinate.
  bool apart_along_axis(double x) const { return side_ * x - offset_ > most_; }
  int axis() const { return axis_; }  // -1: none

  // Whether the vertex is within the separation: decided exactly.
  bool within(const Vec3<double>& x) const;
  // The time of impact of a motion, within 1e-12: 0 if it is within the separation at the start, nothing if it never
  // is.
  std::optional<double> time(const Vec3<double>& x0, const Vec3<double>& x1) const;

  // The signed distance from the plane, positive in the half-space, with an error of a few units in its last place.
  double distance(const Vec3<double>& x) const;
  // Below the distance of this vertex. Cheaper.
  double least_distance(double x, double y, double z) const {
    const auto [f, error] = value(x, y, z);
    return bounds_hold_ ? (f - error) / length_ * (f > error ? 1 - 0x1p-49 : 1 + 0x1p-49) : -INFINITY;
  }
  // The change of the signed distance in a motion.
  double change(const Vec3<double>& x0, const Vec3<double>& x1) const;
  double separation() const { return separation_; }
  const Vec3<double>& unit_normal() const { return unit_; }

 private:
  struct Value {
    double f, error;
  };
  // f = normal . x - offset with the scaled numbers, and a bound on its error. Each product and each sum has a relative
  // error u = 2^-53: those of f are at most 4 u of the sum of magnitudes, which is computed with the same relative
  // error, and f - error is rounded once more: 8 u suffices. Products may also lose 2^-1075 each to underflow, unless
  // they are by 0 or 1.
  Value value(double x, double y, double z) const {
    const double a = normal_.x * x, b = normal_.y * y, c = normal_.z * z;
    return {a + b + c - offset_, relative_ * (std::fabs(a) + std::fabs(b) + std::fabs(c) + std::fabs(offset_)) + lost_};
  }

  Plane plane_;
  double separation_;
  // Scaled by one power of two, so that the largest coordinate of the normal lies in [1, 2).
  Vec3<double> normal_, unit_;
  double offset_, length_;   // length_: of the normal, rounded
  bool bounds_hold_ = true;  // false: a number has lost bits in scaling, or is beyond the range of doubles
  double relative_ = 0x1p-50, lost_ = 0x1p-1070;
  double least_, most_;  // bounds on separation * |normal|
  double far_;           // above most_ and the parts of the error that are the same for all vertices
  int axis_ = -1;
  double side_ = 1;  // for an axis: the normal's coordinate, 1 or -1
};

}  // namespace hpccd
