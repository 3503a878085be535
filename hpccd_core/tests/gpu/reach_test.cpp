// SPDX-License-Identifier: Apache-2.0
// Boxes that grow on the device overlap wherever points come within the separation, near the origin and far from it.
#include "gpu/reach.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "bvh/kdop.h"
#include "bvh/tree.h"

namespace hpccd {
namespace {

// As the device places and grows a vertex of a snapshot: low and high along the axes and along the slanted directions.
struct Grown {
  float low[6], high[6];
  Grown(const Vec3<double>& x, const CoordinateMap& map, float reach) {
    const double at[3] = {x.x, x.y, x.z};
    const SlantedCoordinates slanted(x, map);
    const float by = slanted_reach(reach);
    for (int k = 0; k < 3; ++k) {
      low[k] = map(at[k], k) - reach, high[k] = map(at[k], k) + reach;
      low[3 + k] = slanted.along[k] - by, high[3 + k] = slanted.along[k] + by;
    }
  }
  bool overlaps(const Grown& b) const {
    for (int k = 0; k < 6; ++k)
      if (high[k] < b.low[k] || b.high[k] < low[k]) return false;
    return true;
  }
};

void expect_overlap(double size, double offset, double separation) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> any(-1, 1);
  const double low[3] = {offset - size, offset - size, offset - size},
               high[3] = {offset + size, offset + size, offset + size};
  const CoordinateMap map = CoordinateMap::around(low, high);
  const float reach = gpu::reach_on_device(separation, map.scale, std::abs(offset) + size);
  // Displacements along which the coordinates differ by as much as they can.
  const Vec3<double> along[] = {{1, 0, 0}, {0, 0, -1}, {1, 1, 0}, {1, 0, 1}, {0, -1, -1}, {0, 1, -1}, {1, -1, 0}};
  for (int i = 0; i < 20000; ++i) {
    const Vec3<double> x{offset + 0.5 * size * any(random), offset + 0.5 * size * any(random),
                         offset + 0.5 * size * any(random)};
    Vec3<double> u = along[i % 7];
    u = (separation * (1 - 1e-15) / std::sqrt(dot(u, u))) * u;
    const Vec3<double> y = x + u, between = y - x;
    if (dot(between, between) > separation * separation) continue;
    ASSERT_TRUE(Grown(x, map, reach).overlaps(Grown(y, map, reach))) << size << " at " << offset << ", " << separation;
  }
}

TEST(Reach, CoversTheSeparation) {
  for (const double separation : {1e-9, 1e-4, 0.1, 0.4})
    for (const double offset : {0.0, 1.0, 1e3, 1e6, 1e9, 1e11, 1e13}) expect_overlap(1, offset, separation);
  expect_overlap(1e-150, 1e-148, 1e-151);
  expect_overlap(1e140, 1e147, 1e138);
}

TEST(Reach, IsNothingWithoutASeparationAndNeverInfinite) {
  EXPECT_EQ(gpu::reach_on_device(0, 1, 1e6), 0.0f);
  EXPECT_LT(gpu::reach_on_device(1e300, 1e250, 1), 5.0f);
  EXPECT_GE(gpu::reach_on_device(1e300, 1, 1), 4.5f);
}

}  // namespace
}  // namespace hpccd
