// SPDX-License-Identifier: Apache-2.0
// Vectors of integers, or of polynomials with integer coefficients.
#pragma once

#include <array>

namespace hpccd::exact {

template <class X>
using Vector = std::array<X, 3>;

template <class X>
HPCCD_HOST_DEVICE Vector<X> operator-(const Vector<X>& a, const Vector<X>& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
template <class X>
HPCCD_HOST_DEVICE Vector<X> operator+(const Vector<X>& a, const Vector<X>& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
template <class X, class Y>
HPCCD_HOST_DEVICE auto dot(const Vector<X>& a, const Vector<Y>& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
// Coordinate k of a x b.
template <class X>
HPCCD_HOST_DEVICE auto cross(const Vector<X>& a, const Vector<X>& b, int k) {
  const int i = (k + 1) % 3, j = (k + 2) % 3;
  return a[i] * b[j] - a[j] * b[i];
}
template <class X>
HPCCD_HOST_DEVICE auto cross(const Vector<X>& a, const Vector<X>& b) {
  return Vector<decltype(cross(a, b, 0))>{cross(a, b, 0), cross(a, b, 1), cross(a, b, 2)};
}

}  // namespace hpccd::exact
