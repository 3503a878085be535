// SPDX-License-Identifier: Apache-2.0
// Node pairs that wait for a thread. Each thread traverses depth first with its own stack. A thread that runs out of
// work announces it, and the others give away the older half of their stacks, which holds the larger subtrees. The
// initial list can therefore be short (creating it is serial work), and no thread stays idle while another has work to
// share.
#pragma once

#include <atomic>
#include <vector>

#include "base/spin_lock.h"
#include "traverse/tasks.h"

namespace hpccd {

class PairPool {
 public:
  // Each thread starts with the pairs in its part of the leaves, which it has refitted (parallel_for).
  PairPool(const Tree& tree, const std::vector<NodePair>& pairs, int threads);

  // Whether some thread is idle.
  bool wanted() const { return hungry_.load(std::memory_order_relaxed) > 0; }

  // Moves the older half of a stack to the pool, if it contains enough work.
  void push_half(std::vector<NodePair>& stack);

  // Puts a pair on the empty stack. While others may still give one, calls `meanwhile()` and waits. False: all work is
  // done. The caller counts as busy until the next call.
  template <class Meanwhile>
  bool pop(int thread, std::vector<NodePair>& stack, Meanwhile&& meanwhile) {
    if (pop_one(thread, stack)) return true;
    ++hungry_;
    meanwhile();
    const bool got = wait(thread, stack);
    --hungry_;
    return got;
  }

  // Stops all other threads after an exception.
  void abandon() { abandoned_ = true; }

 private:
  bool pop_one(int thread, std::vector<NodePair>& stack);
  bool wait(int thread, std::vector<NodePair>& stack);

  const Tree& tree_;
  // Read between any two pairs, so it is on a cache line that changes only when a thread runs out of work, not with
  // each transferred pair.
  alignas(64) std::atomic<int> hungry_{0};
  alignas(64) SpinLock lock_;
  std::vector<std::vector<NodePair>> lists_;  // initial pairs of each thread, then those given away
  std::atomic<std::size_t> waiting_pairs_;
  std::atomic<int> busy_{0};
  std::atomic<bool> abandoned_{false};

  friend class BusyThread;
};

// Registers one thread as busy until it ends, also by an exception.
class BusyThread {
 public:
  BusyThread(PairPool& pool, int thread) : pool_(pool), thread_(thread) {}
  ~BusyThread() {
    if (busy_) pool_.abandon(), --pool_.busy_;
  }
  BusyThread(const BusyThread&) = delete;
  BusyThread& operator=(const BusyThread&) = delete;

  // See PairPool::pop.
  template <class Meanwhile>
  bool next(std::vector<NodePair>& stack, Meanwhile&& meanwhile) {
    if (busy_) --pool_.busy_;
    return busy_ = pool_.pop(thread_, stack, meanwhile);
  }

 private:
  PairPool& pool_;
  const int thread_;
  bool busy_ = false;
};

}  // namespace hpccd
