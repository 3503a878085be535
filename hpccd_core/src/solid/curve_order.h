// SPDX-License-Identifier: Apache-2.0
// Points in the order of a space-filling curve (Morton): neighbours on it are near each other.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/cancellation.h"
#include "base/vec3.h"

namespace hpccd {

// code: three interleaved coordinates of 10 bits. Points whose codes begin with the same bits share a box.
struct OnCurve {
  std::uint32_t code;
  std::size_t point;
};

// In the cells of a cube of this lowest corner and size; points beyond it count as in its outermost cells.
class Curve {
 public:
  Curve(const Vec3<double>& low, double size);
  std::uint32_t code(const Vec3<double>& point) const;

 private:
  Vec3<double> low_;
  double per_cell_;
};

// By their codes. Points of the same code keep their order.
void sort_by_code(std::vector<OnCurve>& points, const Cancellation& cancellation);

}  // namespace hpccd
