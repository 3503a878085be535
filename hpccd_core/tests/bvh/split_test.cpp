// SPDX-License-Identifier: Apache-2.0
#include "bvh/split.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace hpccd {
namespace {

using Set = std::vector<Centroid>;
using Numbers = std::vector<std::uint32_t>;

struct Sides {
  Numbers low, high;
  bool operator==(const Sides&) const = default;
};

Sides sides_of(const Set& set, std::uint32_t left) {
  Sides s;
  for (std::size_t i = 0; i < set.size(); ++i) (i < left ? s.low : s.high).push_back(set[i].number);
  std::sort(s.low.begin(), s.low.end());
  std::sort(s.high.begin(), s.high.end());
  return s;
}

// Sorts all of it along the widest axis.
Sides sorted_sides(Set set, std::uint32_t left, int widest) {
  std::sort(set.begin(), set.end(), [widest](const Centroid& a, const Centroid& b) {
    return std::pair{a.center[widest], a.number} < std::pair{b.center[widest], b.number};
  });
  return sides_of(set, left);
}

void expect_right_sides(Set set, std::uint32_t left, int widest, const std::string& what) {
  const auto n = static_cast<std::uint32_t>(set.size());
  std::shuffle(set.begin(), set.end(), std::mt19937(7));
  const Sides expected = sorted_sides(set, left, widest);
  const std::string where = what + ", " + std::to_string(left) + " of " + std::to_string(n);
  Set alone = set, scratch(n);
  split(alone.data(), n, left, scratch.data());
  EXPECT_EQ(expected, sides_of(alone, left)) << where;
  for (int threads : {1, 2, 4, 7}) {
    ThreadPool pool(threads);
    Set together = set;
    split_together(together.data(), n, left, scratch.data(), pool);
    EXPECT_EQ(expected, sides_of(together, left)) << where << ", threads " << threads;
  }
}

Set random_set(std::uint32_t n, float width, float height) {
  std::mt19937 random(n);
  std::uniform_real_distribution<float> at(0, 1);
  Set set(n);
  for (std::uint32_t i = 0; i < n; ++i) set[i] = {{width * at(random), height * at(random), at(random)}, i};
  return set;
}

TEST(Split, TheLowestAlongTheWidestAxisComeFirst) {
  for (const std::uint32_t n : {2u, 3u, 40u, 2047u, 2048u, 50000u, 600000u})
    for (const std::uint32_t left : {1u, n / 3, n / 2, n - 1})
      if (left > 0) {
        expect_right_sides(random_set(n, 30, 2), left, 0, "wide");
        expect_right_sides(random_set(n, 2, 30), left, 1, "high");
      }
}

TEST(Split, WhereManyLieInOnePlace) {
  Set set = random_set(3000, 1, 1);
  for (std::uint32_t i = 0; i < 2000; ++i) set[i].center[0] = 4;  // x is the widest by far
  for (std::uint32_t i = 2000; i < 2100; ++i) set[i].center[0] = 9;
  for (const std::uint32_t left : {1u, 899u, 900u, 901u, 1500u, 2899u, 2900u, 2999u})
    expect_right_sides(set, left, 0, "heaps");
  for (Centroid& p : set) p = {{2, 2, 2}, p.number};
  expect_right_sides(set, 1000, 0, "one point");
}

TEST(Split, AtTheEndsOfFloat) {
  const float largest = std::numeric_limits<float>::max() / 8, smallest = std::numeric_limits<float>::denorm_min();
  for (const float unit : {largest, smallest, 1e-30f}) {
    Set set = random_set(4000, 1, 1);
    for (Centroid& p : set)
      p = {{unit * static_cast<float>(static_cast<int>(p.number * 7919 % 9) - 4), 0, 0}, p.number};
    expect_right_sides(set, 777, 0, "in units of " + std::to_string(unit));
  }
}

}  // namespace
}  // namespace hpccd
