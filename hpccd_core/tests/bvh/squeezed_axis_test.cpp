// SPDX-License-Identifier: Apache-2.0
// Coordinates whose wide gaps are shortened: in order, never farther apart than they were, and sharp in each cluster.
#include "bvh/squeezed_axis.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace hpccd {
namespace {

struct Squeezed {
  std::vector<double> places;  // in order
  std::vector<Stretch> stretches;
  double wanted, least;
  SqueezedAxis axis;
  double scale;

  Squeezed(std::vector<double> of, double half_width, double wanted_, double least_)
      : places(std::move(of)), wanted(wanted_), least(least_), axis(made(half_width)) {
    scale = std::ldexp(1.0, -std::ilogb(axis.length() / 2));
    axis.set_scale(scale);
  }

 private:
  SqueezedAxis made(double half_width) {
    for (const double x : places) stretches.push_back({x - half_width, x + half_width});
    std::ranges::sort(places);
    return {stretches, wanted, least};
  }
};

std::vector<double> clusters(unsigned seed, std::initializer_list<double> centers, int n = 200) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> within(-1, 1);
  std::vector<double> places;
  for (const double center : centers)
    for (int i = 0; i < n; ++i) places.push_back(center + within(random));
  std::ranges::shuffle(places, random);
  return places;
}

void expect_in_order_and_no_farther(const Squeezed& s) {
  for (std::size_t i = 0; i < s.places.size(); ++i) {
    ASSERT_LE(std::fabs(s.axis(s.places[i])), 2.0f);
    for (std::size_t j = i + 1; j < s.places.size(); ++j) {
      const float a = s.axis(s.places[i]), b = s.axis(s.places[j]);
      ASSERT_LE(a, b);
      ASSERT_LE(double{b} - double{a}, (s.places[j] - s.places[i]) * s.scale * (1 + 1e-6) + 5e-7);
    }
  }
}

TEST(SqueezedAxis, KeepsTheOrderAndBringsNothingFartherApart) {
  for (unsigned seed = 0; seed < 4; ++seed) {
    expect_in_order_and_no_farther({clusters(seed, {0, 1e7, 1e7 + 30, -3e12}), 0, 400, 1});
    expect_in_order_and_no_farther({clusters(seed, {1e9, 1e9 + 5}), 0.01, 400, 1});
    expect_in_order_and_no_farther({clusters(seed, {-1e150, 0, 1e-150, 1e150}, 50), 0, 1, 1e-3});
    expect_in_order_and_no_farther({{0, 0, 0, 5, 5, 1e300, -1e300}, 0, 1e-3, 1e-9});
  }
}

TEST(SqueezedAxis, ShortensGapsNoMoreThanItMust) {
  const Squeezed s(clusters(1, {0, 1e7, 1e9}), 0, 400, 1);
  EXPECT_NEAR(s.axis.length(), 400, 1e-6);
  EXPECT_GT(s.axis(1e7) - s.axis(0), 150 * s.scale);  // two gaps alike
  EXPECT_GT(s.axis(1e9) - s.axis(1e7), 150 * s.scale);
  EXPECT_NEAR((s.axis(0.5) - s.axis(-0.5)) / s.scale, 1, 1e-4);
}

TEST(SqueezedAxis, LeavesEachGapAsLongAsWhatCountsAsNear) {
  std::vector<double> places;
  for (int i = 0; i < 100; ++i) places.push_back(1e6 * i);
  const Squeezed s(places, 0, 1, 5);
  EXPECT_DOUBLE_EQ(s.axis.length(), 99 * 5);
  for (int i = 1; i < 100; ++i) EXPECT_GE(s.axis(places[i]) - s.axis(places[i - 1]), 5 * s.scale * (1 - 1e-6));
}

TEST(SqueezedAxis, AMotionCrossesNoGap) {
  std::vector<Stretch> stretches{{0, 1}, {0, 1e6}, {1e6, 1e6 + 1}, {2e9, 2e9}};
  const SqueezedAxis axis(stretches, 1, 1);
  EXPECT_DOUBLE_EQ(axis.length(), (1e6 + 1) + 1);
}

}  // namespace
}  // namespace hpccd
