// SPDX-License-Identifier: Apache-2.0
// Small separate pieces that trade places, over a floor: what a hierarchy that is only refitted copes with worst. All
// rules of pairs of meshes, and vertices in no triangle, occur.
#pragma once

#include <memory>
#include <random>
#include <vector>

#include "hpccd/hpccd.h"

namespace hpccd::test {

inline constexpr std::uint32_t pieces = 60, piece_vertices = 4, swarms = 3, swarm_lone = 2, floor_side = 6;
inline constexpr std::uint32_t swarm_vertices = pieces * piece_vertices + swarm_lone;

inline std::shared_ptr<const Scene> swarm_scene(bool rules) {
  auto scene = std::make_shared<Scene>();
  std::vector<std::uint32_t> faces;
  for (std::uint32_t p = 0; p < pieces; ++p) {
    const std::uint32_t v = p * piece_vertices;
    faces.insert(faces.end(), {v, v + 1, v + 2, v + 1, v + 3, v + 2});
  }
  for (std::uint32_t s = 0; s < swarms; ++s)
    scene->add_mesh("swarm" + std::to_string(s), faces, swarm_vertices, {.self_collision = !rules || s != 1});
  std::vector<std::uint32_t> floor;
  for (std::uint32_t row = 0; row + 1 < floor_side; ++row)
    for (std::uint32_t column = 0; column + 1 < floor_side; ++column) {
      const std::uint32_t a = row * floor_side + column;
      floor.insert(floor.end(), {a, a + 1, a + floor_side, a + 1, a + floor_side + 1, a + floor_side});
    }
  scene->add_mesh("floor", floor, floor_side * floor_side, {.is_static = rules});
  scene->add_mesh("pillar", std::vector<std::uint32_t>{0, 1, 2}, 3, {.is_static = rules});
  if (rules) {
    scene->ignore_pair(0, 2);
    scene->set_accuracy(0, 1, Accuracy::conservative);
  }
  return scene;
}

// Positions at a whole number of steps: from even to odd all pieces stay near their places, from odd to even a quarter
// of them jumps to others.
inline std::vector<double> swarm_positions(int step) {
  std::vector<double> positions;
  for (std::uint32_t s = 0; s < swarms; ++s) {
    for (std::uint32_t p = 0; p < pieces; ++p) {
      const int jumps = (step / 2 + static_cast<int>(p)) / 4;
      std::mt19937 random(1000 * s + 50 * p + static_cast<unsigned>(jumps));
      // Without std::uniform_real_distribution: its numbers differ between standard libraries.
      const auto uniform = [&] { return static_cast<double>(random()) / 4294967296.0; };
      const double x = 5 * uniform(), y = 5 * uniform(), z = 2 * uniform() - 0.3 - 0.1 * (step % 2);
      for (std::uint32_t v = 0; v < piece_vertices; ++v)
        positions.insert(positions.end(), {x + (v & 1) * 0.5 + 0.1 * uniform(), y + (v >> 1) * 0.5 + 0.1 * uniform(),
                                           z + 0.3 * uniform()});
    }
    for (std::uint32_t i = 0; i < swarm_lone; ++i)
      positions.insert(positions.end(), {1.0 + s, 1.3 + i, step % 2 - 0.4});
  }
  for (std::uint32_t i = 0; i < floor_side * floor_side; ++i)
    positions.insert(positions.end(), {i % floor_side * 1.0, i / floor_side * 1.0, 0.0});
  positions.insert(positions.end(), {2, 2, -1, 2.5, 2, 3, 2, 2.7, 3});
  return positions;
}

}  // namespace hpccd::test
