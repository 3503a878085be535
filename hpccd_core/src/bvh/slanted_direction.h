// SPDX-License-Identifier: Apache-2.0
// Additional directions along which boxes of snapshots have bounds.
#pragma once

namespace hpccd {

// A direction in the plane of axis k and the next one, used in place of their sum: a * x[k] + b * x[k+1], times a power
// of two. It is at most as long as the sum, and is rounded once, like the sum.
struct SlantedDirection {
  double a = 1, b = 1, factor = 1;

  template <class X>  // X(k): a coordinate
  double along(int k, X&& x) const {
    return a * x(k) + b * x((k + 1) % 3);
  }
  bool operator==(const SlantedDirection&) const = default;
};
inline constexpr SlantedDirection slanted_directions[] = {{1, 1, 1},    {1, -1, 1},  {1, 2, 0.5},
                                                          {1, -2, 0.5}, {2, 1, 0.5}, {2, -1, 0.5}};

}  // namespace hpccd
