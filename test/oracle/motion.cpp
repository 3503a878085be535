// SPDX-License-Identifier: Apache-2.0
#include "motion.h"

#include <cstddef>
#include <vector>

namespace oracle {

std::array<Vector, 4> motion(const Query& query) { return motion_and_distance(query, 0.0).points; }

MotionAndDistance motion_and_distance(const Query& query, double distance) {
  std::vector<double> numbers{distance};
  for (const auto& point : query) numbers.insert(numbers.end(), point.begin(), point.end());
  const std::vector<Integer> integers = to_integers(numbers).values;
  MotionAndDistance scaled{{}, integers[0]};
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const Integer &start = integers[1 + 3 * i + axis], &end = integers[13 + 3 * i + axis];
      scaled.points[i][axis] = Polynomial({start, end - start});
    }
  return scaled;
}

}  // namespace oracle
