// SPDX-License-Identifier: Apache-2.0
// A waving sheet over a second sheet, in sizes that reach past one leaf and one task: the scene of these tests.
#pragma once

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "hpccd/hpccd.h"

namespace hpccd::test {

inline constexpr std::uint32_t sheets = 2;

inline std::vector<std::uint32_t> sheet_faces(std::uint32_t side) {
  std::vector<std::uint32_t> faces;
  for (std::uint32_t row = 0; row + 1 < side; ++row)
    for (std::uint32_t column = 0; column + 1 < side; ++column) {
      const std::uint32_t a = row * side + column, b = a + 1, c = a + side, d = c + 1;
      faces.insert(faces.end(), {a, b, c, b, d, c});
    }
  return faces;
}

// Two sheets of side x side vertices, and `lone` vertices in no triangle behind each.
inline std::shared_ptr<const Scene> two_sheets(std::uint32_t side, std::uint32_t lone = 0) {
  auto scene = std::make_shared<Scene>();
  for (std::uint32_t sheet = 0; sheet < sheets; ++sheet)
    scene->add_mesh("sheet" + std::to_string(sheet), sheet_faces(side), side * side + lone, {});
  return scene;
}

// Positions at time t, 3 a vertex. The upper sheet falls through the lower one between t = 0 and 1.
inline std::vector<double> sheet_positions(std::uint32_t side, double t, std::uint32_t lone = 0) {
  std::vector<double> positions;
  for (std::uint32_t sheet = 0; sheet < sheets; ++sheet) {
    const double height = sheet * (0.6 - 1.1 * t);
    for (std::uint32_t i = 0; i < side * side; ++i) {
      const double x = (i % side) + 0.31 * sheet, y = (i / side) + 0.17 * sheet;
      positions.insert(positions.end(), {x, y, height + 0.1 * std::sin(0.9 * x + 0.7 * y + 2 * t)});
    }
    for (std::uint32_t i = 0; i < lone; ++i) positions.insert(positions.end(), {0.37 + i, 0.41 + i, 0.5 - t});
  }
  return positions;
}

inline Positions view(const std::vector<double>& positions) { return {positions.data(), positions.size() / 3, true}; }

}  // namespace hpccd::test
