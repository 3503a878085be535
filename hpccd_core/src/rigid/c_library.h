// SPDX-License-Identifier: Apache-2.0
// Functions of the C library, each by itself, as Python calls them. A compiler that sees the sine and the cosine of one
// number asks for both at once, and makes a product of a square: the last bits may be others.
#pragma once

namespace hpccd::rigid {

double sine(double radians);
double cosine(double radians);
double squared(double x);

}  // namespace hpccd::rigid
