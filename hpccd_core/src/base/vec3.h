// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/hd.h"
#include "base/real.h"

namespace hpccd {

template <class R>
struct Vec3 {
  R x, y, z;
  HPCCD_HD friend Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  HPCCD_HD friend Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  HPCCD_HD friend Vec3 operator*(R s, Vec3 a) { return {s * a.x, s * a.y, s * a.z}; }
};

template <class R>
HPCCD_HD R dot(Vec3<R> a, Vec3<R> b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

template <class R>
HPCCD_HD Vec3<R> cross(Vec3<R> a, Vec3<R> b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

// The largest absolute coordinate.
template <class R>
HPCCD_HD R max_norm(Vec3<R> a) {
  return greater(greater(magnitude(a.x), magnitude(a.y)), magnitude(a.z));
}

}  // namespace hpccd
