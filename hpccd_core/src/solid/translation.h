// SPDX-License-Identifier: Apache-2.0
// The least translation along a direction that separates two meshes, exactly.
#pragma once

#include "solid/moved_pair.h"

namespace hpccd {

// The infimum of the s >= 0 for which mesh a, moved by s along the direction (of any finite length above 0), neither
// meets mesh b nor is inside it nor contains it. Within 1e-14 of its size.
double separating_translation(const MovedPair& pair, const Vec3<double>& direction);

// The same for a translation along a direction, as the contact at its end; without features where nothing is in the
// way.
ContactTime first_separation(const Translation& translation);

}  // namespace hpccd
