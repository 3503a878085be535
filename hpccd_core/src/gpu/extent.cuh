// SPDX-License-Identifier: Apache-2.0
// How far a world reaches in a frame, as its counters have it, and the map of its coordinates that follows.
#pragma once

#include "bvh/coordinate_map.h"
#include "gpu/launch_params.cuh"

namespace hpccd::gpu {

// Bits of a double whose order as integers is the order of the numbers.
__device__ inline u64 ordered_bits(double x) {
  const u64 b = static_cast<u64>(__double_as_longlong(x));
  return b >> 63 ? ~b : b | (u64{1} << 63);
}
__device__ inline double from_ordered_bits(u64 b) {
  return __longlong_as_double(static_cast<long long>(b >> 63 ? b & ~(u64{1} << 63) : ~b));
}

struct SceneExtent {
  double low[3], high[3];

  __device__ explicit SceneExtent(const WorldCounters& c) {
    for (int k = 0; k < 3; ++k)
      low[k] = from_ordered_bits(~c.extent_low[k]), high[k] = from_ordered_bits(c.extent_high[k]);
  }
  __device__ CoordinateMap map() const { return CoordinateMap::around(low, high); }
  __device__ double largest() const {
    double x = 0;
    for (int k = 0; k < 3; ++k) x = greater(x, greater(magnitude(low[k]), magnitude(high[k])));
    return x;
  }
};

}  // namespace hpccd::gpu
