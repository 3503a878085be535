// SPDX-License-Identifier: Apache-2.0
#include "intersection.h"

#include <cstddef>
#include <vector>

#include "distance.h"
#include "vec.h"

namespace oracle {
namespace {

// The edge has its ends on both sides of the plane and runs through the inside of the face.
bool pierces(const std::array<std::array<double, 3>, 5>& q) {
  std::vector<double> numbers;
  for (const auto& point : q) numbers.insert(numbers.end(), point.begin(), point.end());
  const std::vector<Integer> x = to_integers(numbers).values;
  const auto corner = [&](std::size_t i) { return Vec<Integer>{x[3 * i], x[3 * i + 1], x[3 * i + 2]}; };
  const Vec<Integer> p = corner(0), a = corner(2) - p, b = corner(3) - p, c = corner(4) - p, e = corner(1) - p;
  const Vec<Integer> n = cross(b - a, c - a);
  const Integer start = dot(n, a), end = dot(n, a - e);  // how far the plane lies beyond either end
  if (start.sign() * end.sign() >= 0) return false;
  const int ab = dot(e, cross(a, b)).sign(), bc = dot(e, cross(b, c)).sign(), ca = dot(e, cross(c, a)).sign();
  return ab != 0 && ab == bc && bc == ca;
}

}  // namespace

// A common point is an end of the edge, or on the face's border, or inside both. In the last case the edge passes
// through the face, or it lies in its plane and has an end in the face or continues to the border.
bool edge_face_intersect(const std::array<std::array<double, 3>, 5>& q) {
  const auto& [p0, p1, a, b, c] = q;
  return within_vertex_face({p0, a, b, c}, 0.0) || within_vertex_face({p1, a, b, c}, 0.0) ||
         within_edge_edge({p0, p1, a, b}, 0.0) || within_edge_edge({p0, p1, b, c}, 0.0) ||
         within_edge_edge({p0, p1, c, a}, 0.0) || pierces(q);
}

}  // namespace oracle
