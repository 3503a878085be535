// SPDX-License-Identifier: Apache-2.0
#include "motion.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace hpccd::reference {
namespace {

// x = mantissa * 2^exponent with an odd mantissa, or 0.
std::pair<long long, int> odd_mantissa(double x) {
  if (x == 0.0) return {0, std::numeric_limits<int>::max()};
  int exponent;
  auto mantissa = static_cast<long long>(std::ldexp(std::frexp(x, &exponent), 53));
  const int zeros = __builtin_ctzll(static_cast<unsigned long long>(mantissa));
  return {mantissa / (1LL << zeros), exponent - 53 + zeros};
}

}  // namespace

std::array<Vector, 4> motion(const Query& query) {
  int lowest = std::numeric_limits<int>::max();
  for (const auto& point : query)
    for (double x : point) lowest = std::min(lowest, odd_mantissa(x).second);
  const auto to_integer = [&](double x) {
    const auto [mantissa, exponent] = odd_mantissa(x);
    return mantissa == 0 ? Integer(0) : Integer(Integer(mantissa) << static_cast<unsigned>(exponent - lowest));
  };
  std::array<Vector, 4> points;
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const Integer start = to_integer(query[i][axis]), end = to_integer(query[i + 4][axis]);
      points[i][axis] = Polynomial({start, end - start});
    }
  return points;
}

}  // namespace hpccd::reference
