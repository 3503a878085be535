// SPDX-License-Identifier: Apache-2.0
// Functions of the C library, each called separately, as Python calls them. A compiler that sees sine and cosine of
// the same number calls both at once, and turns a square into a product: the last bits may differ.
#pragma once

namespace hpccd::rigid {

double sine(double radians);
double cosine(double radians);
double squared(double x);

}  // namespace hpccd::rigid
