// SPDX-License-Identifier: Apache-2.0
#include "rigid/c_library.h"

#include <gtest/gtest.h>

#include <cmath>

namespace hpccd::rigid {
namespace {

// Pointers that are read when they are used: the compiler knows neither the function nor what it could be merged with.
double (*const volatile sin_of_library)(double) = std::sin;
double (*const volatile cos_of_library)(double) = std::cos;
double (*const volatile pow_of_library)(double, double) = std::pow;

TEST(CLibrary, EachFunctionGivesWhatItGivesByItself) {
  for (int k = -2000; k <= 2000; ++k) {
    const double x = 0.01234567 * k;
    EXPECT_EQ(sine(x), sin_of_library(x)) << x;
    EXPECT_EQ(cosine(x), cos_of_library(x)) << x;
    EXPECT_EQ(squared(x), pow_of_library(x, 2.0)) << x;
  }
}

}  // namespace
}  // namespace hpccd::rigid
