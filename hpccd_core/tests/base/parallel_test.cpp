// SPDX-License-Identifier: Apache-2.0
#include "base/parallel.h"

#include <gtest/gtest.h>

#include <chrono>
#include <stdexcept>
#include <vector>

namespace hpccd {
namespace {

TEST(ThreadPool, RunsTheJobOncePerThread) {
  for (int threads : {1, 2, 7}) {
    ThreadPool pool(threads);
    ASSERT_EQ(pool.size(), threads);
    std::vector<int> calls(threads);
    for (int repeat = 0; repeat < 50; ++repeat) pool.run([&](int thread) { ++calls[thread]; });
    EXPECT_EQ(calls, std::vector<int>(threads, 50));
  }
}

TEST(ThreadPool, ZeroMeansAllCores) { EXPECT_GE(ThreadPool(0).size(), 1); }

TEST(ThreadPool, RethrowsAnExceptionOfAJobAndGoesOn) {
  ThreadPool pool(3);
  for (int failing = 0; failing < 3; ++failing)
    EXPECT_THROW(pool.run([&](int thread) {
      if (thread == failing) throw std::runtime_error("a job failed");
    }),
                 std::runtime_error);
  std::vector<int> calls(3);
  pool.run([&](int thread) { ++calls[thread]; });
  EXPECT_EQ(calls, std::vector<int>(3, 1));
}

TEST(ThreadPool, WakesThreadsThatHaveGoneToSleep) {
  for (int threads : {2, 4, 64}) {
    ThreadPool pool(threads);
    std::vector<int> calls(threads);
    for (int repeat = 0; repeat < 20; ++repeat) {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
      pool.run([&](int thread) { ++calls[thread]; });
    }
    EXPECT_EQ(calls, std::vector<int>(threads, 20));
  }
}

TEST(ThreadPool, WaitsForAThreadThatIsLong) {
  ThreadPool pool(3);
  for (int slow = 0; slow < 3; ++slow) {
    std::atomic<int> done{0};
    pool.run([&](int thread) {
      if (thread == slow) std::this_thread::sleep_for(std::chrono::milliseconds(20));
      ++done;
    });
    EXPECT_EQ(done, 3);
  }
}

TEST(ParallelFor, VisitsEachIndexOnceInPiecesOfTheGrain) {
  for (int threads : {1, 4}) {
    ThreadPool pool(threads);
    for (std::size_t n : {0u, 1u, 63u, 64u, 65u, 1000u}) {
      std::vector<int> visits(n);
      parallel_for(pool, n, 64, [&](std::size_t begin, std::size_t end, int thread) {
        EXPECT_LT(begin, end);
        EXPECT_LT(thread, threads);
        EXPECT_LE(end - begin, 64u);
        for (std::size_t i = begin; i < end; ++i) ++visits[i];
      });
      EXPECT_EQ(visits, std::vector<int>(n, 1));
    }
  }
}

}  // namespace
}  // namespace hpccd
