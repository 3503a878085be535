// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>

#include "hpccd/errors.h"
#include "hpccd/scene.h"

namespace hpccd {

// Throws InvalidArgument unless all numbers are finite and the normal is not zero.
inline void check_plane(const Plane& plane) {
  if (!std::ranges::all_of(plane.normal, [](double x) { return std::isfinite(x); }))
    throw InvalidArgument("normal: must be finite");
  if (std::ranges::all_of(plane.normal, [](double x) { return x == 0; }))
    throw InvalidArgument("normal: is zero; give a vector that points into the half-space");
  if (!std::isfinite(plane.offset)) throw InvalidArgument("offset: must be finite");
}

}  // namespace hpccd
