// SPDX-License-Identifier: Apache-2.0
#include "origin_in_triangle.h"

#include <algorithm>

#include "algebraic.h"

namespace oracle {
namespace {

bool vanishes(const Vector& v, Root& t) { return t.sign_of(v[0]) == 0 && t.sign_of(v[1]) == 0 && t.sign_of(v[2]) == 0; }

// a and b on one line with the origin and not on the same side of it; an end at the origin counts.
bool segment_contains_origin(const Vector& a, const Vector& b, Root& t) {
  return vanishes(cross(a, b), t) && t.sign_of(dot(a, b)) <= 0;
}

// For a time at which the origin is in the plane of a, b and c. The three cross products are then parallel to
// each other, and the origin's barycentric coordinates are their ratios to their sum, which is the triangle's
// normal.
bool triangle_contains_origin(const Vector& a, const Vector& b, const Vector& c, Root& t) {
  const Vector u = cross(b, c), v = cross(c, a), w = cross(a, b);
  const Vector normal = u + v + w;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int side = t.sign_of(normal[axis]);
    if (side == 0) continue;
    return t.sign_of(u[axis]) * side >= 0 && t.sign_of(v[axis]) * side >= 0 && t.sign_of(w[axis]) * side >= 0;
  }
  // No area: the triangle is the union of its edges.
  return segment_contains_origin(a, b, t) || segment_contains_origin(b, c, t) || segment_contains_origin(c, a, t);
}

template <class Predicate>
std::optional<double> first_that_holds(std::vector<Root> ascending, Predicate holds) {
  for (Root& t : ascending)
    if (holds(t)) return t.rounded_down();
  return {};
}

std::optional<double> earlier(std::optional<double> a, std::optional<double> b) {
  return a && b ? std::min(*a, *b) : a ? a : b;
}

std::optional<double> origin_in_segment(const Vector& a, const Vector& b) {
  const auto contains = [&](Root& t) { return segment_contains_origin(a, b, t); };
  const Vector off_line = cross(a, b);
  for (const Polynomial& component : off_line)
    if (!component.is_zero()) return first_that_holds(roots_in_unit_interval(component), contains);
  // On one line throughout: contact from the start, or from when an end reaches the origin and the product's
  // sign can change.
  const Polynomial product = dot(a, b);
  Root start = Root::exactly(0, 0);
  if (contains(start)) return 0.0;
  return first_that_holds(roots_in_unit_interval(product), contains);
}

}  // namespace

std::optional<double> origin_in_triangle(const Vector& a, const Vector& b, const Vector& c) {
  const auto contains = [&](Root& t) { return triangle_contains_origin(a, b, c, t); };
  const Polynomial volume = dot(cross(a, b), c);
  if (!volume.is_zero()) return first_that_holds(roots_in_unit_interval(volume), contains);
  // In one plane with the origin throughout. If contact does not exist from the start it begins on an edge: a
  // point inside a triangle that has an area, and in whose plane it stays, was inside just before as well.
  Root start = Root::exactly(0, 0);
  if (contains(start)) return 0.0;
  return earlier(origin_in_segment(a, b), earlier(origin_in_segment(b, c), origin_in_segment(c, a)));
}

}  // namespace oracle
