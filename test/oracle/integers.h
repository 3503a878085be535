// SPDX-License-Identifier: Apache-2.0
// Doubles as integers of any size, and back.
#pragma once

#include <boost/multiprecision/cpp_int.hpp>
#include <vector>

namespace oracle {

// 512 bits kept inside the object: the coefficients of common queries then need no heap memory. Larger ones
// grow.
using Integer =
    boost::multiprecision::number<boost::multiprecision::cpp_int_backend<512, 0>, boost::multiprecision::et_off>;

// Each number is value * 2^exponent: one power of two for all of them.
struct Integers {
  std::vector<Integer> values;
  int exponent;
};

// Finite numbers only.
Integers to_integers(const std::vector<double>& numbers);

// The double nearest to n * 2^exponent, n >= 0, ties to even; +inf beyond the largest.
double nearest_double(const Integer& n, int exponent);

// The double nearest to the root of numerator / denominator * 4^exponent; numerator >= 0, denominator > 0.
double nearest_root(const Integer& numerator, const Integer& denominator, int exponent);

}  // namespace oracle
