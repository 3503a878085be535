// SPDX-License-Identifier: Apache-2.0
// Along a direction that stays, features on straight lines move linearly: the gap between their projections is the
// least of linear functions, so where it is large at both ends of an interval it is large in between.
#include "apart.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "vec.h"

namespace oracle {
namespace {

using Vector3 = Vec<double>;

constexpr int deepest = 10;           // halvings of the step
constexpr int corrections = 12;       // of a direction; a bad one only proves less
constexpr double rounding = 0x1p-45;  // of a projection, beside the largest coordinate: some ten roundings of 2^-53

class Difference {
 public:
  Difference(const Query& query, std::size_t n_first, double distance)
      : query_(query), n_first_(n_first), distance_(distance) {
    for (const auto& point : query)
      for (double coordinate : point) largest_ = std::max(largest_, std::abs(coordinate));
  }

  // As apart_until, of the interval; the features are looked at from the left.
  double apart_until(double begin, double end, int depth) const {
    if (apart_during(begin, end)) return end;
    if (depth == deepest) return begin;
    const double middle = (begin + end) / 2;
    const double left = apart_until(begin, middle, depth + 1);
    return left < middle ? left : apart_until(middle, end, depth + 1);
  }

 private:
  struct Points {
    std::array<Vector3, 4> list;  // differences of a point of each feature
    std::size_t n;
  };

  Points at(double time) const {
    std::array<Vector3, 4> place;
    for (std::size_t i = 0; i < 4; ++i)
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double start = query_[i][axis], end = query_[4 + i][axis];
        place[i][axis] = time == 1 ? end : start + time * (end - start);
      }
    Points points{{}, 0};
    for (std::size_t i = 0; i < n_first_; ++i)
      for (std::size_t j = n_first_; j < 4; ++j) points.list[points.n++] = place[j] - place[i];
    return points;
  }

  bool apart_during(double begin, double end) const {
    Vector3 direction = from_origin(at((begin + end) / 2));
    const double size = std::max({std::abs(direction[0]), std::abs(direction[1]), std::abs(direction[2])});
    if (!(size > std::numeric_limits<double>::min()) || !std::isfinite(size)) return false;
    for (double& coordinate : direction) coordinate /= size;
    const double length = std::sqrt(dot(direction, direction)) * (1 + rounding);
    const double needed = distance_ * length + 4 * rounding * largest_ + 16 * std::numeric_limits<double>::denorm_min();
    for (double time : {begin, end}) {
      const Points points = at(time);
      for (std::size_t i = 0; i < points.n; ++i)
        if (!(dot(direction, points.list[i]) > needed)) return false;
    }
    return true;
  }

  // About the point of their convex hull that is nearest to the origin (Frank and Wolfe 1956).
  static Vector3 from_origin(const Points& points) {
    Vector3 nearest = points.list[0];
    for (std::size_t i = 1; i < points.n; ++i) nearest = nearest + points.list[i];
    for (double& coordinate : nearest) coordinate /= static_cast<double>(points.n);
    for (int turn = 0; turn < corrections; ++turn) {
      const auto* lowest =
          std::min_element(points.list.begin(), points.list.begin() + points.n,
                           [&](const Vector3& a, const Vector3& b) { return dot(nearest, a) < dot(nearest, b); });
      const Vector3 way = *lowest - nearest;
      const double square = dot(way, way);
      if (!(square > 0)) break;
      const double part = std::clamp(-dot(nearest, way) / square, 0.0, 1.0);
      for (std::size_t axis = 0; axis < 3; ++axis) nearest[axis] += part * way[axis];
    }
    return nearest;
  }

  const Query& query_;
  std::size_t n_first_;
  double distance_;
  double largest_ = 0;
};

}  // namespace

double apart_until(const Query& query, std::size_t n_first, double distance) {
  return Difference(query, n_first, distance).apart_until(0, 1, 0);
}

}  // namespace oracle
