// SPDX-License-Identifier: Apache-2.0
#include "paper/scheduling.h"

#include <gtest/gtest.h>

#include <thread>

#include "paper/shared_pairs.h"

namespace hpccd::paper {
namespace {

void wait_for_request(const Scheduling& scheduling, int thread) {
  while (!scheduling.requested(thread)) std::this_thread::yield();
}

TEST(Scheduling, AsksTheThreadWhoseFrontNodeCoversMostTriangles) {
  Scheduling scheduling(4);
  scheduling.begin();
  scheduling.show_front(0, 30);
  scheduling.show_front(1, 70);
  scheduling.show_front(2, 50);
  TaskUnitQueue received;
  std::thread requesting([&] { EXPECT_TRUE(scheduling.request(3, received)); });
  wait_for_request(scheduling, 1);
  EXPECT_FALSE(scheduling.requested(0));
  EXPECT_FALSE(scheduling.requested(2));
  TaskUnitQueue units{11, 12, 13};
  EXPECT_EQ(scheduling.distribute(1, units), 1u);
  requesting.join();
  EXPECT_EQ(received, TaskUnitQueue{11}) << "the front node, likely the most work";
  EXPECT_EQ(units, (TaskUnitQueue{12, 13}));
  EXPECT_FALSE(scheduling.requested(1));
}

TEST(Scheduling, KeepsItsLastNodeAndLetsTheOtherWait) {
  Scheduling scheduling(2);
  scheduling.begin();
  TaskUnitQueue received;
  std::thread requesting([&] { EXPECT_TRUE(scheduling.request(1, received)); });
  wait_for_request(scheduling, 0);
  TaskUnitQueue units{5};
  EXPECT_EQ(scheduling.distribute(0, units), 0u);
  EXPECT_TRUE(scheduling.requested(0));
  units.push_back(6);
  EXPECT_EQ(scheduling.distribute(0, units), 1u);
  requesting.join();
  EXPECT_EQ(received, TaskUnitQueue{5});
}

TEST(Scheduling, EndsWhenNoThreadHasWork) {
  constexpr int n = 5;
  Scheduling scheduling(n);
  for (int round = 0; round < 50; ++round) {
    scheduling.begin();
    std::vector<std::thread> threads;
    for (int i = 0; i < n; ++i)
      threads.emplace_back([&, i] {
        TaskUnitQueue units;
        EXPECT_FALSE(scheduling.request(i, units));
      });
    for (auto& t : threads) t.join();
  }
}

TEST(Scheduling, AThreadThatEndsEarlyLeavesNobodyWaiting) {
  Scheduling scheduling(2);
  scheduling.begin();
  TaskUnitQueue received;
  std::thread requesting([&] { EXPECT_FALSE(scheduling.request(1, received)); });
  wait_for_request(scheduling, 0);
  scheduling.leave(0);
  requesting.join();
  EXPECT_TRUE(received.empty());
}

// Units that multiply as they are done, as in Listing 1: each is done once, whoever does it.
TEST(Scheduling, EveryUnitIsDoneOnce) {
  constexpr int n = 4;
  constexpr NodeIndex last = 4000;
  Scheduling scheduling(n);
  for (int round = 0; round < 10; ++round) {
    std::vector<std::atomic<int>> done(last + 1);
    std::atomic<std::uint32_t> given{0};
    scheduling.begin();
    std::vector<std::thread> threads;
    for (int i = 0; i < n; ++i)
      threads.emplace_back([&, i] {
        TaskUnitQueue units;
        if (i == 0) units.push_back(1);
        do {
          while (!units.empty()) {
            const NodeIndex unit = units.front();
            units.pop_front();
            ++done[unit];
            for (NodeIndex child : {2 * unit, 2 * unit + 1})
              if (child <= last) units.push_back(child);
            scheduling.show_front(i, units.empty() ? 0 : last - units.front());
            if (scheduling.requested(i)) given += scheduling.distribute(i, units);
          }
        } while (scheduling.request(i, units));
      });
    for (auto& t : threads) t.join();
    for (NodeIndex unit = 1; unit <= last; ++unit) ASSERT_EQ(done[unit], 1) << "unit " << unit;
  }
}

TEST(SharedPairs, HandsTheOlderHalfToWhoWaits) {
  SharedPairs shared;
  shared.begin(2);
  PairQueue own{{0, 1}, {0, 2}, {0, 3}, {0, 4}}, other;
  EXPECT_FALSE(shared.wanted());
  std::thread waiting([&] { EXPECT_TRUE(shared.pop(other)); });
  while (!shared.wanted()) std::this_thread::yield();
  shared.push_half(own);
  waiting.join();
  EXPECT_EQ(other, (PairQueue{{0, 1}, {0, 2}}));
  EXPECT_EQ(own, (PairQueue{{0, 3}, {0, 4}}));
}

TEST(SharedPairs, EndsWhenAllWaitOrHaveLeft) {
  SharedPairs shared;
  shared.begin(3);
  std::vector<std::thread> threads;
  for (int i = 0; i < 2; ++i)
    threads.emplace_back([&] {
      PairQueue own;
      EXPECT_FALSE(shared.pop(own));
    });
  shared.leave();
  for (auto& t : threads) t.join();
}

}  // namespace
}  // namespace hpccd::paper
