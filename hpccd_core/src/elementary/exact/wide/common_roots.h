// SPDX-License-Identifier: Apache-2.0
// What two polynomials have in common; of any degree.
#pragma once

#include "elementary/exact/wide/part.h"

namespace hpccd::exact::wide {

// The greatest common factor, without content; of degree 0 where no number is a root of both.
Numbers common_factor(Coefficients f, Coefficients g);

// With the same roots as p, each of them once.
Numbers square_free(Coefficients p);

}  // namespace hpccd::exact::wide
