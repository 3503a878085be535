// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>

#include "base/active_wait.h"

namespace hpccd {

// For a few instructions at a time. std::mutex puts whoever finds it taken to sleep, and Linux wakes him on the core of
// the one who gives it back, where he waits for that one's time slice to end: 2.3 ms of a step of 1.4 were seen, with
// the core idle that he had come from.
class SpinLock {
 public:
  void lock() {
    for (ActiveWait wait; taken_.exchange(true, std::memory_order_acquire);)
      while (taken_.load(std::memory_order_relaxed)) wait.turn();
  }
  void unlock() { taken_.store(false, std::memory_order_release); }

 private:
  std::atomic<bool> taken_{false};
};

}  // namespace hpccd
