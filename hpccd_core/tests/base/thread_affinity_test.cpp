// SPDX-License-Identifier: Apache-2.0
#if defined(__linux__)
#include "base/thread_affinity.h"

#include <gtest/gtest.h>
#include <pthread.h>

#include <set>

namespace hpccd {
namespace {

cpu_set_t allowed_of(pthread_t thread) {
  cpu_set_t set;
  EXPECT_EQ(pthread_getaffinity_np(thread, sizeof set, &set), 0);
  return set;
}

bool equal(const cpu_set_t& a, const cpu_set_t& b) { return CPU_EQUAL(&a, &b); }

// As many threads as this process has cores, the test's own included. The others sleep until the end, or until told to
// report that they were woken.
class Sleepers : public testing::Test {
 protected:
  Sleepers() : allowed(allowed_of(pthread_self())), affinity(CPU_COUNT(&allowed)) {
    for (int i = 1; i < CPU_COUNT(&allowed); ++i)
      threads.emplace_back([this, i] {
        step.wait(0);
        affinity.woken(i);
        ++woken;
        step.wait(1);
      });
  }
  void wake_up() {
    ++step;
    step.notify_all();
  }
  ~Sleepers() override {
    step = 2;
    step.notify_all();
    for (std::thread& t : threads) t.join();
  }

  const cpu_set_t allowed;
  std::atomic<int> step{0}, woken{0};
  ThreadAffinity affinity;
  std::vector<std::thread> threads;
};

TEST_F(Sleepers, AreBoundToACoreEachUntilTheyRun) {
  if (threads.empty()) GTEST_SKIP() << "one core only";
  ASSERT_TRUE(affinity.place(threads));
  std::set<int> cores;
  for (std::thread& t : threads) {
    const cpu_set_t set = allowed_of(t.native_handle());
    ASSERT_EQ(CPU_COUNT(&set), 1);
    for (int core = 0; core < CPU_SETSIZE; ++core)
      if (CPU_ISSET(core, &set)) {
        EXPECT_TRUE(CPU_ISSET(core, &allowed));
        cores.insert(core);
      }
  }
  EXPECT_EQ(cores.size(), threads.size());

  wake_up();
  while (woken < static_cast<int>(threads.size())) std::this_thread::yield();
  for (std::thread& t : threads) EXPECT_TRUE(equal(allowed_of(t.native_handle()), allowed));
  EXPECT_TRUE(equal(allowed_of(pthread_self()), allowed));
}

TEST_F(Sleepers, ThatDoNotComeInTimeAreFreedByTheCaller) {
  if (threads.empty()) GTEST_SKIP() << "one core only";
  ASSERT_TRUE(affinity.place(threads));
  affinity.free_late(threads);
  for (std::thread& t : threads) EXPECT_TRUE(equal(allowed_of(t.native_handle()), allowed));
}

TEST_F(Sleepers, SeenOnOneCoreAreMovedApart) {
  if (threads.empty()) GTEST_SKIP() << "one core only";
  // Called from here, all report the core of this thread.
  for (std::size_t i = 1; i <= threads.size(); ++i) affinity.awake(static_cast<int>(i));
  ASSERT_TRUE(affinity.place(threads));
  int bound = 0;
  for (std::thread& t : threads) {
    const cpu_set_t set = allowed_of(t.native_handle());
    bound += CPU_COUNT(&set) == 1;
  }
  // All; but one where the kernel moved this thread to another core in the meantime.
  EXPECT_GE(bound, static_cast<int>(threads.size()) - 1);
  affinity.free_late(threads);
}

TEST_F(Sleepers, AreLeftAloneWhereTheCoresAreNotAsManyAsThreads) {
  if (threads.empty()) GTEST_SKIP() << "one core only";
  cpu_set_t one;
  CPU_ZERO(&one);
  for (int core = 0; CPU_COUNT(&one) == 0; ++core)
    if (CPU_ISSET(core, &allowed)) CPU_SET(core, &one);
  ASSERT_EQ(pthread_setaffinity_np(pthread_self(), sizeof one, &one), 0);
  EXPECT_FALSE(affinity.place(threads));
  ASSERT_EQ(pthread_setaffinity_np(pthread_self(), sizeof allowed, &allowed), 0);
  for (std::thread& t : threads) EXPECT_TRUE(equal(allowed_of(t.native_handle()), allowed));
}

}  // namespace
}  // namespace hpccd
#endif
