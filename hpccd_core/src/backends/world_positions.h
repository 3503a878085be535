// SPDX-License-Identifier: Apache-2.0
// One world of many: its part of all positions, and its name in messages.
#pragma once

#include <cstddef>
#include <string>

#include "hpccd/hpccd.h"

namespace hpccd {

// n_vertices: of each world.
inline Positions of_world(Positions all, std::size_t n_vertices, std::size_t world) {
  const std::size_t row = 3 * (all.is_double ? sizeof(double) : sizeof(float));
  all.data = static_cast<const std::byte*>(all.data) + world * n_vertices * row;
  all.n = n_vertices;
  return all;
}

// "vertices_t1[17, 2] is NaN" of world 3 is vertices_t1[3, 17, 2].
inline std::string with_world(std::string text, std::size_t world) {
  for (const char* name : {"vertices_t0[", "vertices_t1[", "vertices[", "points["})
    if (const std::size_t at = text.find(name); at != std::string::npos)
      return text.insert(at + std::string(name).size(), std::to_string(world) + ", ");
  return "world " + std::to_string(world) + ": " + text;
}

}  // namespace hpccd
