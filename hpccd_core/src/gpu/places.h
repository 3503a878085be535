// SPDX-License-Identifier: Apache-2.0
// What hosts and devices tell each other of the places of a frame's rows.
#pragma once

#include <cstdint>

#include "elementary/fallback.h"

namespace hpccd::gpu {

// A row whose places only integers can tell.
struct OpenRow {
  std::uint64_t row;  // vertex-face, then edge-edge
  double toc;
  UndecidedPair pair;
};

}  // namespace hpccd::gpu
