// SPDX-License-Identifier: Apache-2.0
#include "rigid/c_library.h"

#include <cmath>

namespace hpccd::rigid {
namespace {

// Read at run time: a compiler that knows the exponent replaces the call by a product.
const volatile double two = 2.0;

}  // namespace

// Not inlined, even with link-time optimisation.
__attribute__((noinline)) double sine(double radians) { return std::sin(radians); }
__attribute__((noinline)) double cosine(double radians) { return std::cos(radians); }
double squared(double x) { return std::pow(x, two); }

}  // namespace hpccd::rigid
