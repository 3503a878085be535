// SPDX-License-Identifier: Apache-2.0
// Greatest common divisors of two polynomials of any degree.
#pragma once

#include "elementary/exact/wide/part.h"

namespace hpccd::exact::wide {

// True if the sequence of remainders ends in a number other than zero, modulo a prime that divides neither leading
// coefficient: then f and g have no common root. False: undecided.
bool certainly_no_common_root(Coefficients f, Coefficients g);

// The greatest common divisor, without content; of degree 0 if there is no common root.
Numbers common_factor(Coefficients f, Coefficients g);

// A multiple of f / g, without content; g must be a factor of f.
Numbers quotient(Numbers f, const Numbers& g);

bool divides(const Numbers& g, Coefficients f);

// A polynomial with the roots of p, each of them simple.
Numbers square_free(Coefficients p);

}  // namespace hpccd::exact::wide
