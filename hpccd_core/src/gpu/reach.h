// SPDX-License-Identifier: Apache-2.0
// The amount by which boxes on the device grow, so that boxes of features within a separation of each other overlap.
#pragma once

#include "base/hd.h"
#include "base/real.h"

namespace hpccd::gpu {

// In the boxes' own coordinates (coordinate_map.h), for `largest` in those of the scene: half of the separation, plus
// the rounding errors of a coordinate as a float and of growing it (2.4e-7 and 4.8e-7 for two boxes; along the slanted
// directions of a snapshot twice that, and the errors of their sums of two coordinates far from the origin). A reach
// beyond the size of the scene would not add pairs.
HPCCD_HD float reach_on_device(double separation, double scale, double largest) {
  if (!(separation > 0)) return 0;
  return static_cast<float>(lesser(0.5 * separation * scale + 1e-15 * (largest * scale), 4.5) * (1 + 1e-6) + 1e-6);
}

}  // namespace hpccd::gpu
