// SPDX-License-Identifier: Apache-2.0
// How far a motion is free, by the public C++ interface; beside detection, and on any number of threads.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <limits>
#include <thread>

#include "grid_scene.h"
#include "hpccd/hpccd.h"

namespace hpccd {
namespace {

constexpr std::uint32_t side = 15;
constexpr double early = 1e-9;  // what the tiers exact and conservative may lose of a step

Detector detector(Options options = {}) {
  options.backend = Backend::cpu;
  return {test::two_sheets(side), options};
}

double first_toc(const Contacts& contacts) {
  double first = std::numeric_limits<double>::infinity();
  for (const auto* tocs : {&contacts.vf_toc, &contacts.ee_toc})
    for (const double toc : *tocs) first = std::min(first, toc);
  return first;
}

TEST(CollisionFreeStep, EndsAtTheEarliestContact) {
  const auto start = test::sheet_positions(side, 0), end = test::sheet_positions(side, 1);
  for (const Accuracy accuracy : {Accuracy::fast, Accuracy::balanced, Accuracy::conservative, Accuracy::exact}) {
    Detector d = detector({.accuracy = accuracy});
    const double first = first_toc(d.detect(test::view(start), test::view(end)));
    ASSERT_TRUE(first > 0.1 && first < 0.9);
    const double step = d.collision_free_step(test::view(start), test::view(end));
    EXPECT_LE(step, first);
    EXPECT_GE(step, accuracy == Accuracy::exact || accuracy == Accuracy::conservative ? first - early : first);
  }
}

TEST(CollisionFreeStep, IsTheSameOnAnyNumberOfThreadsAndForAnyReport) {
  const auto start = test::sheet_positions(side, 0), end = test::sheet_positions(side, 1);
  const double alone = detector({.threads = 1}).collision_free_step(test::view(start), test::view(end));
  for (const int threads : {2, 3, 8})
    for (const Report report : {Report::all, Report::first, Report::any}) {
      Detector d = detector({.report = report, .threads = threads});
      for (int call = 0; call < 3; ++call) EXPECT_EQ(d.collision_free_step(test::view(start), test::view(end)), alone);
    }
}

TEST(CollisionFreeStep, IsTheWholeStepWhereNothingTouchesAndNoneWhereItDoesAtTheStart) {
  Detector d = detector();
  const auto start = test::sheet_positions(side, 0), later = test::sheet_positions(side, 0.01);
  EXPECT_EQ(d.collision_free_step(test::view(start), test::view(later)), 1.0);
  EXPECT_EQ(d.collision_free_step(test::view(start), test::view(start)), 1.0);
  auto touching = start;  // a vertex of the upper sheet on one of the lower
  std::copy_n(touching.begin(), 3, touching.begin() + 3 * (side * side + 40));
  EXPECT_EQ(d.collision_free_step(test::view(touching), test::view(later)), 0.0);
  Detector empty(std::make_shared<Scene>(), {.backend = Backend::cpu});
  EXPECT_EQ(empty.collision_free_step({nullptr, 0, true}, {nullptr, 0, true}), 1.0);
}

TEST(CollisionFreeStep, OfTrialStepsIsThatOfANewDetector) {
  const auto start = test::sheet_positions(side, 0);
  auto other = start;
  other[3 * (side * side + 40) + 2] -= 0.4;  // one vertex of the upper sheet, so much nearer to the lower one
  Detector d = detector({.threads = 2});
  for (const double t : {1.0, 0.5, 0.9, 0.25, 1.0, 0.01, 0.7}) {
    const auto end = test::sheet_positions(side, t);
    for (const auto& first : {start, other, start})
      EXPECT_EQ(d.collision_free_step(test::view(first), test::view(end)),
                detector({.threads = 1}).collision_free_step(test::view(first), test::view(end)));
  }
}

TEST(CollisionFreeStep, KeepsTheSeparationInForce) {
  const auto start = test::sheet_positions(side, 0), end = test::sheet_positions(side, 1);
  Detector d = detector();
  double last = 1;
  for (const double separation : {0.0, 0.01, 0.1, 0.2}) {
    d.set_separation(0, 1, separation);
    const double step = d.collision_free_step(test::view(start), test::view(end));
    const double first = first_toc(d.detect(test::view(start), test::view(end)));
    EXPECT_TRUE(first - early <= step && step <= first) << separation;
    EXPECT_LT(step, last);
    last = step;
  }
  d.set_separation(0, 1, 2.0);
  EXPECT_EQ(d.collision_free_step(test::view(start), test::view(end)), 0.0);
}

TEST(CollisionFreeStep, RefusesPositionsThatDoNotFitTheScene) {
  Detector d = detector();
  const auto start = test::sheet_positions(side, 0), end = test::sheet_positions(side, 1);
  const double step = d.collision_free_step(test::view(start), test::view(end));
  const auto too_few = std::vector(start.begin(), start.begin() + 6);
  auto not_finite = start;
  not_finite[7] = std::numeric_limits<double>::quiet_NaN();
  for (const auto& bad : {too_few, not_finite}) {
    EXPECT_THROW(d.collision_free_step(test::view(start), test::view(bad)), InvalidArgument);
    EXPECT_THROW(d.collision_free_step(test::view(bad), test::view(end)), InvalidArgument);
    EXPECT_EQ(d.collision_free_step(test::view(start), test::view(end)), step);
  }
}

TEST(CollisionFreeStep, CancelEndsIt) {
  const auto start = test::sheet_positions(side, 0), end = test::sheet_positions(side, 1);
  for (const int threads : {1, 4}) {
    Detector d = detector({.threads = threads});
    std::thread other([&] {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      d.cancel();
    });
    EXPECT_THROW(for (;;) d.collision_free_step(test::view(start), test::view(end)), Cancelled);
    other.join();
    EXPECT_THROW(d.collision_free_step(test::view(start), test::view(end)), Cancelled);
  }
}

TEST(CollisionFreeStep, OfSeveralThreadsTakesTurns) {
  const auto start = test::sheet_positions(side, 0), end = test::sheet_positions(side, 1);
  Detector shared = detector({.threads = 2});
  const double there = shared.collision_free_step(test::view(start), test::view(end));
  const double back = shared.collision_free_step(test::view(end), test::view(start));
  ASSERT_NE(there, back);
  std::vector<std::thread> callers;
  for (int caller = 0; caller < 4; ++caller)
    callers.emplace_back([&, caller] {
      for (int call = 0; call < 10; ++call) {
        const bool forth = (caller + call) % 2 == 0;
        EXPECT_EQ(shared.collision_free_step(test::view(forth ? start : end), test::view(forth ? end : start)),
                  forth ? there : back);
      }
    });
  for (std::thread& caller : callers) caller.join();
}

}  // namespace
}  // namespace hpccd
