// SPDX-License-Identifier: Apache-2.0
#include "line_in_hull.h"

#include <algorithm>
#include <cstddef>

namespace oracle {

// Seen along the direction the line is the origin. Both ends are basic solutions of a linear program: the origin is one
// point, or between two, or inside a triangle of three, and u is interpolated.
std::optional<std::pair<Fraction, Fraction>> line_in_hull(const std::vector<Corner>& points,
                                                          const Vec<Integer>& direction) {
  std::size_t along = 0;
  while (direction[along] == 0) ++along;
  const std::size_t i1 = (along + 1) % 3, i2 = (along + 2) % 3;
  const std::size_t n = points.size();
  std::vector<std::array<Integer, 2>> flat;
  for (const Corner& x : points)
    flat.push_back(
        {direction[along] * x[i1] - direction[i1] * x[along], direction[along] * x[i2] - direction[i2] * x[along]});
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const auto side = [&](int sign) {
      return std::all_of(flat.begin(), flat.end(), [&](const auto& x) { return x[axis].sign() == sign; });
    };
    if (side(1) || side(-1)) return std::nullopt;
  }

  std::optional<std::pair<Fraction, Fraction>> range;
  const auto add = [&](Integer height, Integer over) {  // height / over along the axis
    over *= direction[along];
    if (over < 0) height = -height, over = -over;
    const Fraction u{height, over};
    if (!range) range = {u, u};
    if (u < range->first) range->first = u;
    if (range->second < u) range->second = u;
  };
  const auto turn = [&](std::size_t i, std::size_t j) {
    return Integer(flat[i][0] * flat[j][1] - flat[i][1] * flat[j][0]);
  };
  const auto is_zero = [&](std::size_t i) { return flat[i][0] == 0 && flat[i][1] == 0; };
  for (std::size_t i = 0; i < n; ++i) {
    if (is_zero(i)) add(points[i][along], 1);
    for (std::size_t j = i + 1; j < n; ++j) {
      const Integer ij = turn(i, j);
      if (ij == 0 && !is_zero(i) && !is_zero(j)) {
        const std::size_t axis = flat[i][0] == 0 ? 1 : 0;
        const Integer& a = flat[i][axis];
        const Integer& b = flat[j][axis];
        if (a.sign() * b.sign() < 0) add(b * points[i][along] - a * points[j][along], b - a);
      }
      for (std::size_t k = j + 1; k < n; ++k) {
        const Integer jk = turn(j, k), ki = turn(k, i);
        if (ij.sign() != 0 && ij.sign() == jk.sign() && jk.sign() == ki.sign())
          add(jk * points[i][along] + ki * points[j][along] + ij * points[k][along], ij + jk + ki);
      }
    }
  }
  return range;
}

}  // namespace oracle
