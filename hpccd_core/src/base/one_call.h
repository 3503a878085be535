// SPDX-License-Identifier: Apache-2.0
// One call at a time, on whatever thread; a mutex for std::lock_guard that a child made by fork() can tell was held by
// a thread that it does not have.
#pragma once

#include <atomic>
#include <mutex>
#include <stdexcept>

#include "base/forks.h"

namespace hpccd {

class OneCall {
 public:
  void lock() {
    if (abandoned())
      throw std::runtime_error(
          "this detector was in a call of another thread when this process was forked; make one after the fork");
    turn_.lock();
    process_.store(forks(), std::memory_order_relaxed);
  }
  void unlock() {
    process_.store(none, std::memory_order_relaxed);
    turn_.unlock();
  }
  // What it protects was left in the middle of a change.
  bool abandoned() const {
    const int process = process_.load(std::memory_order_relaxed);
    return process != none && process != forks();
  }

 private:
  static constexpr int none = -1;
  std::mutex turn_;
  std::atomic<int> process_{none};  // of the call under way
};

}  // namespace hpccd
