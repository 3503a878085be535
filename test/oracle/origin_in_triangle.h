// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "polynomial.h"

namespace oracle {

// Earliest t in [0,1] at which the closed triangle with the moving corners a, b, c contains the origin,
// rounded down to a double; none where it never does. Corners are linear in t; the triangle may be degenerate
// at any time.
std::optional<double> origin_in_triangle(const Vector& a, const Vector& b, const Vector& c);

}  // namespace oracle
