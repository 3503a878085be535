// SPDX-License-Identifier: Apache-2.0
// Real roots in [0, 1] of an integer polynomial, isolated by the roots of its derivatives.
#pragma once

#include "elementary/exact/wide/root.h"

namespace hpccd::exact::wide {

// All distinct roots in [0, 1] of p, not constant, in order.
std::vector<Root> roots(Coefficients p);

}  // namespace hpccd::exact::wide
