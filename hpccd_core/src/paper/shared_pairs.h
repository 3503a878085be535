// SPDX-License-Identifier: Apache-2.0
// Redistribution in the naive method (Kim et al. 2009, section 3.2): threads without pairs take some from a shared
// queue behind a lock; threads with pairs put half of theirs there while others wait.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <mutex>

#include "paper/hierarchy.h"

namespace hpccd::paper {

using PairQueue = std::deque<Pair>;

class SharedPairs {
 public:
  void begin(int threads);

  // Whether threads wait while nothing is shared: read without a lock.
  bool wanted() const {
    return waiting_.load(std::memory_order_relaxed) > 0 && size_.load(std::memory_order_relaxed) == 0;
  }
  // Moves the older half of the queue to the shared one: pairs of large nodes, which cost most.
  void push_half(PairQueue& own);
  // Waits for pairs; false if no thread has any left.
  bool pop(PairQueue& own);
  // For a thread that ends early.
  void leave();

  std::size_t redistributions() const { return redistributions_; }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  PairQueue pairs_;
  int threads_ = 0;
  std::size_t redistributions_ = 0;
  std::atomic<int> waiting_{0};
  std::atomic<std::size_t> size_{0};
};

}  // namespace hpccd::paper
