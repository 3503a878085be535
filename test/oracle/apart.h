// SPDX-License-Identifier: Apache-2.0
// A time up to which two moving features certainly stay apart, in double precision. With it the oracle omits most exact
// tests if only the earliest contact counts.
#pragma once

#include <cstddef>

#include "elementary.h"

namespace oracle {

// A time in [0,1] up to which the features stay farther than the distance from each other; 1 where this is proven for
// the whole step. The first n_first points are one feature, the others of the four the other.
double apart_until(const Query& query, std::size_t n_first, double distance);

}  // namespace oracle
