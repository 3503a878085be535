// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace hpccd {

// Beyond this, differences and squares of coordinates could overflow in the error bounds.
inline constexpr double largest_coordinate = 1e150;
// For one snapshot only differences are computed before ranges are checked.
inline constexpr double largest_in_snapshot = 1e300;

}  // namespace hpccd
