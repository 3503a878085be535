// SPDX-License-Identifier: Apache-2.0
// Winding numbers of closed meshes.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "exact_mesh.h"

namespace oracle {

// A mesh seen along a direction without zero components: each point x becomes (z-component of the direction) (x, y) -
// (x, y)-component * z, and crossings of lines in this direction are points in triangles.
class View {
 public:
  View(const std::vector<Corner>& corners, const std::vector<Triangle>& faces, const Vec<Integer>& direction);

  // The sum over the faces that the ray from the point crosses in their inside: +1 where it leaves the side from which
  // they are counterclockwise, -1 where it enters. None where it passes through a border of a face or lies in one.
  std::optional<int> crossings(const Corner& point) const;

 private:
  using Flat = std::array<Integer, 2>;
  struct Box {
    Flat low, high;
  };
  Flat flat(const Corner& x) const;

  std::vector<Corner> corners_;
  std::vector<Triangle> faces_;
  Vec<Integer> direction_;
  std::vector<Flat> flat_;
  std::vector<Box> boxes_;
};

// The winding number of a point that is on no face.
int winding_number(const std::vector<Corner>& corners, const std::vector<Triangle>& faces, const Corner& point);

struct Windings {
  std::vector<std::int32_t> numbers;  // 0 on the surface
  std::vector<std::uint8_t> on_surface;
};

Windings winding_numbers(const std::vector<std::array<double, 3>>& vertices, const std::vector<Triangle>& faces,
                         const std::vector<std::array<double, 3>>& points, unsigned threads);

}  // namespace oracle
