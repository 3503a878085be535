// SPDX-License-Identifier: Apache-2.0
#include "base/parallel.h"

#include <algorithm>
#include <utility>

#include "base/pause.h"

namespace hpccd {

ThreadPool::Entry ThreadPool::Entry::of(std::uint64_t w) {
  return {static_cast<std::uint32_t>(w >> 32), ((w >> 31) & 1) != 0, static_cast<std::uint16_t>((w >> 16) & 0x7FFF),
          static_cast<std::uint16_t>(w & 0xFFFF)};
}

std::uint64_t ThreadPool::Entry::word() const {
  return std::uint64_t{job} << 32 | std::uint64_t{closed} << 31 | std::uint64_t{joined} << 16 | finished;
}

ThreadPool::ThreadPool(int threads) {
  const int cores = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  const int n = threads > 0 ? threads : cores;
  // About 200 us, longer than the serial parts between two jobs of a call. More threads than cores would only keep
  // each other from working.
  rounds_awake_ = n <= cores ? 5000 : 0;
  for (int i = 1; i < n; ++i) workers_.emplace_back([this, i] { work(i); });
}

ThreadPool::~ThreadPool() {
  {
    std::lock_guard lock(mutex_);
    stop_ = true;
  }
  start_.notify_all();
  for (auto& w : workers_) w.join();
}

void ThreadPool::call(int thread) {
  try {
    (*job_)(thread);
  } catch (...) {
    std::lock_guard lock(mutex_);
    if (!error_) error_ = std::current_exception();
  }
}

bool ThreadPool::new_job(std::uint32_t seen) const { return Entry::of(entry_.load()).job != seen || stop_.load(); }

void ThreadPool::wait_for_job(std::uint32_t seen) {
  for (int i = 0; i < rounds_awake_; ++i) {
    if (new_job(seen)) return;
    pause();
  }
  std::unique_lock lock(mutex_);
  ++sleeping_;
  start_.wait(lock, [&] { return new_job(seen); });
  --sleeping_;
}

bool ThreadPool::join(std::uint32_t& seen) {
  std::uint64_t word = entry_.load();
  for (;;) {
    Entry e = Entry::of(word);
    if (e.job == seen) return false;
    if (e.closed) {
      seen = e.job;
      return false;
    }
    ++e.joined;
    if (entry_.compare_exchange_weak(word, e.word())) {
      seen = e.job;
      return true;
    }
  }
}

void ThreadPool::work(int thread) {
  std::uint32_t seen = 0;
  while (!stop_) {
    wait_for_job(seen);
    if (!join(seen)) continue;
    call(thread);
    entry_.fetch_add(1);
    std::lock_guard lock(mutex_);
    if (caller_sleeps_) done_.notify_one();
  }
}

bool ThreadPool::finished(Join join) const {
  const Entry e = Entry::of(entry_.load());
  return e.finished == (join == Join::all ? workers_.size() : e.joined);
}

void ThreadPool::wait_for_threads(Join join) {
  for (int i = 0; i < rounds_awake_; ++i) {
    if (finished(join)) return;
    pause();
  }
  std::unique_lock lock(mutex_);
  caller_sleeps_ = true;
  done_.wait(lock, [&] { return finished(join); });
  caller_sleeps_ = false;
}

void ThreadPool::run(const std::function<void(int)>& job, Join join) {
  if (workers_.empty()) return job(0);
  job_ = &job;
  error_ = nullptr;
  entry_ = Entry{Entry::of(entry_.load()).job + 1, false, 0, 0}.word();
  {
    std::lock_guard lock(mutex_);
    if (sleeping_ > 0) start_.notify_all();
  }
  call(0);
  if (join == Join::in_time) entry_.fetch_or(Entry{0, true, 0, 0}.word());
  wait_for_threads(join);
  if (auto error = std::exchange(error_, nullptr)) std::rethrow_exception(error);
}

}  // namespace hpccd
