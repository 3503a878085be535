// SPDX-License-Identifier: Apache-2.0
// Where backend "auto" sends the steps.
#include "backends/tuner.h"

#include <gtest/gtest.h>

#include "backends/failures.h"

namespace hpccd {
namespace {

const std::vector<Backend> all{Backend::cpu, Backend::gpu, Backend::hybrid};

void expect_turns(Tuner& tuner, const std::vector<Backend>& usable, double ms) {
  for (int turn = 0; turn < 3; ++turn)
    for (const Backend b : usable) {
      EXPECT_EQ(tuner.next(usable), b);
      tuner.took(b, b == Backend::gpu ? ms / 2 : ms);
    }
}

TEST(Tuner, TakesTurnsAndThenTheFastest) {
  Tuner tuner;
  expect_turns(tuner, all, 10);
  for (int step = 0; step < 5; ++step) {
    EXPECT_EQ(tuner.next(all), Backend::gpu);
    tuner.took(Backend::gpu, 100);  // one slow step does not count
  }
  tuner.took(Backend::cpu, 1);
  EXPECT_EQ(tuner.next(all), Backend::cpu);
}

TEST(Tuner, StepsThatFailedHadTheirTurnAndNoTime) {
  Tuner tuner;
  for (int turn = 0; turn < 3; ++turn) {
    EXPECT_EQ(tuner.next({Backend::cpu, Backend::gpu}), Backend::cpu);
    tuner.took(Backend::cpu, 50);
    EXPECT_EQ(tuner.next({Backend::cpu, Backend::gpu}), Backend::gpu);
    tuner.failed(Backend::gpu);
  }
  EXPECT_EQ(tuner.next({Backend::cpu, Backend::gpu}), Backend::cpu);
}

TEST(Tuner, WhatIsNoLongerUsableIsNotChosen) {
  Tuner tuner;
  expect_turns(tuner, all, 10);
  EXPECT_EQ(tuner.next({Backend::cpu, Backend::hybrid}), Backend::cpu);
}

TEST(Failures, ThreeInARowAreEnough) {
  Failures failures;
  for (int step = 0; step < 2; ++step) failures.failed("first");
  failures.succeeded();
  for (int step = 0; step < 2; ++step) failures.failed("second");
  EXPECT_FALSE(failures.gave_up());
  failures.failed("third");
  EXPECT_TRUE(failures.gave_up());
  EXPECT_EQ(failures.count(), 5u);
  EXPECT_EQ(failures.last(), "third");
}

}  // namespace
}  // namespace hpccd
