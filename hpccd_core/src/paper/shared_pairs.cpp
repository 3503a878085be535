// SPDX-License-Identifier: Apache-2.0
#include "paper/shared_pairs.h"

#include <algorithm>

namespace hpccd::paper {

void SharedPairs::begin(int threads) {
  pairs_.clear();
  threads_ = threads;
  redistributions_ = 0;
  waiting_ = 0;
  size_ = 0;
}

void SharedPairs::push_half(PairQueue& own) {
  {
    std::lock_guard lock(mutex_);
    ++redistributions_;
    for (std::size_t half = own.size() / 2; half > 0; --half) {
      pairs_.push_back(own.front());
      own.pop_front();
    }
    size_ = pairs_.size();
  }
  changed_.notify_all();
}

bool SharedPairs::pop(PairQueue& own) {
  std::unique_lock lock(mutex_);
  ++waiting_;
  if (waiting_ == threads_) changed_.notify_all();
  changed_.wait(lock, [&] { return !pairs_.empty() || waiting_ == threads_; });
  if (pairs_.empty()) return false;  // still counted as waiting, like all others
  // A share for every waiting thread.
  const std::size_t share =
      (pairs_.size() + static_cast<std::size_t>(waiting_) - 1) / static_cast<std::size_t>(waiting_);
  --waiting_;  // before anything can throw: a thread that leaves must not be counted
  for (std::size_t i = 0; i < share; ++i) {
    own.push_back(pairs_.front());
    pairs_.pop_front();
  }
  size_ = pairs_.size();
  return true;
}

void SharedPairs::leave() {
  {
    std::lock_guard lock(mutex_);
    --threads_;
  }
  changed_.notify_all();
}

}  // namespace hpccd::paper
