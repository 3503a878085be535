// SPDX-License-Identifier: Apache-2.0
// Data that host and device exchange about the points, normals and nearest points of a frame's rows.
#pragma once

#include <cstdint>

#include "elementary/motion.h"

namespace hpccd::gpu {

// A row that only integers can decide. Words only: padding of a struct would be copied uninitialised.
struct OpenRow {
  std::uint64_t row;  // vertex-face, then edge-edge
  double toc, separation;
  Vec3<double> t0[4], t1[4];
};
static_assert(sizeof(OpenRow) == 8 * (3 + 2 * 4 * 3));

}  // namespace hpccd::gpu
