// SPDX-License-Identifier: Apache-2.0
#include "traverse/sampled_time.h"

#include <gtest/gtest.h>

#include <chrono>

namespace {

void take(double seconds) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  while (std::chrono::steady_clock::now() < end) {
  }
}

TEST(SampledTime, OneOfManyStandsForAll) {
  hpccd::SampledTime time;
  const double elsewhere = 0;
  int done = 0;
  for (std::uint64_t i = 0; i < 64; ++i) {
    time.run(i, elsewhere, [&] {
      ++done;
      if (i == 0) take(1e-3);
    });
  }
  EXPECT_EQ(done, 64);
  EXPECT_GE(time.seconds(), 64 * 0.5e-3);  // less what a look at the clock takes, and it may be interrupted
}

TEST(SampledTime, WhatBelongsToOthersIsLeftOut) {
  hpccd::SampledTime time;
  double elsewhere = 1;
  time.run(0, elsewhere, [&] {
    take(1e-3);
    elsewhere += 100;
  });
  EXPECT_EQ(time.seconds(), 0);
}

}  // namespace
