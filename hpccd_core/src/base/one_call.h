// SPDX-License-Identifier: Apache-2.0
// Allows one call at a time, on any thread: a lock for std::lock_guard. The lock word also holds the process of its
// holder, so that a child made by fork() can detect that the lock was held by a thread that the child does not have.
#pragma once

#include <atomic>
#include <stdexcept>

#include "base/forks.h"

namespace hpccd {

class OneCall {
 public:
  void lock() {
    const int mine = forks() + 1;
    for (int holder = none; !holder_.compare_exchange_strong(holder, mine, std::memory_order_acquire); holder = none) {
      if (holder != mine)
        throw std::runtime_error(
            "this detector was in a call of another thread when this process was forked; make one after the fork");
      holder_.wait(holder);
    }
  }
  void unlock() {
    holder_.store(none, std::memory_order_release);
    holder_.notify_one();
  }
  // Whether lock() would wait or throw now.
  bool held() const { return holder_.load(std::memory_order_relaxed) != none; }
  // Whether the protected data was left in an inconsistent state.
  bool abandoned() const {
    const int holder = holder_.load(std::memory_order_relaxed);
    return holder != none && holder != forks() + 1;
  }

 private:
  static constexpr int none = 0;
  std::atomic<int> holder_{none};
};

}  // namespace hpccd
