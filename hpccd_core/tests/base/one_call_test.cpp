// SPDX-License-Identifier: Apache-2.0
#include "base/one_call.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <vector>

namespace hpccd {
namespace {

TEST(OneCall, LetsOneInAtATime) {
  OneCall call;
  int n = 0;
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i)
    threads.emplace_back([&] {
      for (int k = 0; k < 10000; ++k) {
        const std::lock_guard turn(call);
        EXPECT_TRUE(call.held());
        ++n;
      }
    });
  for (auto& t : threads) t.join();
  EXPECT_EQ(n, 40000);
  EXPECT_FALSE(call.held());
  EXPECT_FALSE(call.abandoned());
}

// Exit status of a child: 0 if it enters, 1 if it gets the error.
int in_a_child(OneCall& call) {
  const pid_t child = fork();
  if (child == 0) {
    alarm(10);
    try {
      const std::lock_guard turn(call);
      _exit(call.abandoned() ? 2 : 0);
    } catch (const std::runtime_error&) {
      _exit(call.abandoned() ? 1 : 2);
    }
  }
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

TEST(OneCall, AChildIsToldOfACallOfItsParent) {
  OneCall call;
  EXPECT_EQ(in_a_child(call), 0);
  {
    const std::lock_guard turn(call);
    EXPECT_EQ(in_a_child(call), 1);
  }
  EXPECT_EQ(in_a_child(call), 0);
}

// Independent of what the other thread does at that moment.
TEST(OneCall, NoChildWaitsForEver) {
  OneCall call;
  std::atomic<bool> going{true};
  std::thread other([&] {
    while (going) const std::lock_guard turn(call);
  });
  for (int i = 0; i < 200; ++i) EXPECT_GE(in_a_child(call), 0) << i;
  going = false;
  other.join();
}

}  // namespace
}  // namespace hpccd
