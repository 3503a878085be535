// SPDX-License-Identifier: Apache-2.0
// Triangles that hang together by twos at most: leaves of a hierarchy have up to twenty-four corners, not some ten.
#pragma once

#include <memory>
#include <random>
#include <string>
#include <vector>

#include "hpccd/hpccd.h"

namespace hpccd::test {

inline std::shared_ptr<const Scene> soup_scene(std::uint32_t n) {
  auto scene = std::make_shared<Scene>();
  for (std::uint32_t mesh = 0; mesh < 2; ++mesh) {
    std::vector<std::uint32_t> faces;
    for (std::uint32_t i = 0; i < 3 * n; ++i) faces.push_back(i);
    for (std::uint32_t i = 0; i + 1 < n; i += 7) faces[3 * (i + 1)] = faces[3 * i + 2];
    scene->add_mesh("soup" + std::to_string(mesh), faces, 3 * n, {});
  }
  return scene;
}

inline std::vector<double> soup_positions(std::uint32_t n, unsigned seed) {
  std::mt19937 random(5), drift(seed);
  std::uniform_real_distribution<double> place(-3, 3), size(-0.5, 0.5), way(-0.2, 0.2);
  std::vector<double> positions;
  for (std::uint32_t triangle = 0; triangle < 2 * n; ++triangle) {
    const double x = place(random), y = place(random), z = 0.2 * place(random);
    for (int corner = 0; corner < 3; ++corner)
      for (const double center : {x, y, z}) positions.push_back(center + size(random) + way(drift));
  }
  return positions;
}

}  // namespace hpccd::test
