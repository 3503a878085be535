// SPDX-License-Identifier: Apache-2.0
// Boxes at both ends of a motion: what they call apart is apart at every time, and the tree's own comparison of them
// says the same.
#include "bvh/motion_box.h"

#include <gtest/gtest.h>

#include <random>

#include "bvh/tree.h"

namespace hpccd {
namespace {

// On a lattice, so that bounds often meet exactly; at times with a denominator of 8 all sums below are exact.
struct Interval {
  int low0, high0, low1, high1;
  double low(double t) const { return low0 + t * (low1 - low0); }
  double high(double t) const { return high0 + t * (high1 - high0); }
};

MotionBox box_of(const Interval along[3]) {
  MotionBox b;
  for (int k = 0; k < 3; ++k) {
    b.t0.low[k] = static_cast<float>(along[k].low0), b.t0.high[k] = static_cast<float>(along[k].high0);
    b.t1.low[k] = static_cast<float>(along[k].low1), b.t1.high[k] = static_cast<float>(along[k].high1);
  }
  return b;
}

TEST(MotionBox, ApartMeansApartAtEveryTime) {
  std::mt19937 random(3);
  std::uniform_int_distribution<int> place(-6, 6), size(0, 3);
  int met = 0, apart_though_swept = 0;
  for (int i = 0; i < 100'000; ++i) {
    Interval a[3], b[3];
    for (int k = 0; k < 3; ++k)
      for (Interval* x : {&a[k], &b[k]}) {
        x->low0 = place(random), x->high0 = x->low0 + size(random);
        x->low1 = place(random), x->high1 = x->low1 + size(random);
      }
    bool meet = false;
    for (double t = 0; t <= 1; t += 0.125) {
      bool overlap = true;
      for (int k = 0; k < 3; ++k) overlap = overlap && a[k].low(t) <= b[k].high(t) && b[k].low(t) <= a[k].high(t);
      meet = meet || overlap;
    }
    Node x, y;
    x.box = box_of(a), y.box = box_of(b);
    ASSERT_FALSE(meet && !x.box.overlaps(y.box)) << i;
    ASSERT_EQ(x.box.overlaps(y.box), x.overlaps(y)) << i;
    ASSERT_EQ(y.box.overlaps(x.box), x.overlaps(y)) << i;
    met += meet;
    apart_though_swept += !x.overlaps(y) && x.box.swept().overlaps(y.box.swept());
  }
  EXPECT_GT(met, 1000);
  EXPECT_GT(apart_though_swept, 1000);
}

TEST(MotionBox, WhatMovesTogetherStaysApart) {
  MotionBox a, b;
  for (int k = 0; k < 3; ++k) {
    a.t0.low[k] = 0, a.t0.high[k] = 1, a.t1.low[k] = 100, a.t1.high[k] = 101;
    b.t0.low[k] = 1.5f, b.t0.high[k] = 2, b.t1.low[k] = 101.5f, b.t1.high[k] = 102;
  }
  EXPECT_TRUE(a.swept().overlaps(b.swept()));
  EXPECT_FALSE(a.overlaps(b));
  b.t1.low[0] = b.t1.low[1] = b.t1.low[2] = 101;  // meets at the end
  EXPECT_TRUE(a.overlaps(b));
}

}  // namespace
}  // namespace hpccd
