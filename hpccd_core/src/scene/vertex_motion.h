// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace hpccd {

// One vertex at both ends of the step: one cache line, which kernels load as a whole.
struct alignas(64) VertexMotion {
  double t0[4], t1[4];  // x y z and padding
};

// The same as floats, in the coordinates of the boxes (bvh/coordinate_map.h): half a cache line.
struct alignas(32) RoundedMotion {
  float t0[4], t1[4];  // x y z and padding
};

}  // namespace hpccd
