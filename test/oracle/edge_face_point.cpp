// SPDX-License-Identifier: Apache-2.0
#include "edge_face_point.h"

#include <cstddef>
#include <limits>

#include "intersection.h"
#include "line_in_hull.h"

namespace oracle {

std::optional<std::array<double, 7>> edge_face_point(const std::array<std::array<double, 3>, 5>& q) {
  const Integers all = coordinates(q);
  const std::vector<Corner> x = corners_of(all.values, 0, 5);
  const Corner &p = x[0], &a = x[2], &b = x[3], &c = x[4];
  const Vec<Integer> along = x[1] - p;
  Fraction t{0, 1};
  if (along == Vec<Integer>{}) {
    if (!edge_face_intersect(q)) return std::nullopt;
  } else {
    const auto inside = line_in_hull({a - p, b - p, c - p}, along);
    const Fraction end{1, 1};
    if (!inside || end < inside->first || inside->second < t) return std::nullopt;
    if (t < inside->first) t = inside->first;
  }
  std::array<double, 7> found;
  found[0] = nearest_quotient(t.n, t.over, 0);
  const Corner point = times(t.over, p) + times(t.n, along);  // over t.over
  const Vec<Integer> normal = cross(b - a, c - a);
  const auto weight = [&](const Corner& u, const Corner& v) {
    if (normal == Vec<Integer>{}) return std::numeric_limits<double>::quiet_NaN();
    const Vec<Integer> area = cross(times(t.over, u) - point, times(t.over, v) - point);
    return nearest_quotient(dot(normal, area), t.over * t.over * dot(normal, normal), 0);
  };
  found[1] = weight(b, c), found[2] = weight(c, a), found[3] = weight(a, b);
  for (std::size_t i = 0; i < 3; ++i) found[4 + i] = nearest_quotient(point[i], t.over, all.exponent);
  return found;
}

}  // namespace oracle
