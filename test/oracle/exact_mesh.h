// SPDX-License-Identifier: Apache-2.0
// Meshes with integer coordinates, and fractions of integers.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "integers.h"
#include "vec.h"

namespace oracle {

using Corner = Vec<Integer>;
using Triangle = std::array<std::uint32_t, 3>;  // as Face in brute_force.h

// over > 0
struct Fraction {
  Integer n, over;
};

inline bool operator<(const Fraction& a, const Fraction& b) { return a.n * b.over < b.n * a.over; }

inline Vec<Integer> times(const Integer& factor, const Vec<Integer>& v) {
  return {factor * v[0], factor * v[1], factor * v[2]};
}

// Points at numbers[3 i] to numbers[3 i + 2] for each i from first to last.
inline std::vector<Corner> corners_of(const std::vector<Integer>& numbers, std::size_t first, std::size_t last) {
  std::vector<Corner> corners;
  for (std::size_t i = first; i < last; ++i)
    corners.push_back({numbers[3 * i], numbers[3 * i + 1], numbers[3 * i + 2]});
  return corners;
}

// All coordinates of several lists of points as integers of one scale.
template <class... Lists>
Integers coordinates(const Lists&... lists) {
  std::vector<double> numbers;
  const auto append = [&](const auto& points) {
    for (const auto& point : points) numbers.insert(numbers.end(), point.begin(), point.end());
  };
  (append(lists), ...);
  return to_integers(numbers);
}

// Signed: nearest_root takes the magnitude.
inline double nearest_quotient(const Integer& n, const Integer& over, int exponent) {
  const double magnitude = nearest_root(n * n, over * over, exponent);
  return n.sign() * over.sign() < 0 ? -magnitude : magnitude;
}

}  // namespace oracle
