// SPDX-License-Identifier: Apache-2.0
// Points are edges from a vertex to itself: their pairs are found among edge-edge pairs.
#pragma once

#include "hpccd/results.h"

namespace hpccd {

// Moves pairs with points from ee to vv and ve, with their outputs, in contacts of one world or of many. Rows of vf, ee
// and vp come first.
void split_points(Contacts& contacts);

}  // namespace hpccd
