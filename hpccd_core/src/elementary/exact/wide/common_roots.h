// SPDX-License-Identifier: Apache-2.0
// Greatest common divisors of two polynomials of any degree.
#pragma once

#include "elementary/exact/wide/part.h"

namespace hpccd::exact::wide {

// Whether their remainders end in something else than zero, seen modulo a prime that divides neither leading number: if
// so, no number is a root of both. False: it stays open.
bool certainly_no_common_root(Coefficients f, Coefficients g);

// The greatest common factor, without content; of degree 0 where no number is a root of both.
Numbers common_factor(Coefficients f, Coefficients g);

// A multiple of f / g, without content; g must be a factor of f.
Numbers quotient(Numbers f, const Numbers& g);

bool divides(const Numbers& g, Coefficients f);

// With the same roots as p, each of them once.
Numbers square_free(Coefficients p);

}  // namespace hpccd::exact::wide
