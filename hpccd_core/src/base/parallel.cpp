// SPDX-License-Identifier: Apache-2.0
#include "base/parallel.h"

#include <algorithm>
#include <exception>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>

#include "base/active_wait.h"
#include "base/forks.h"
#include "base/standard_arithmetic.h"

namespace hpccd {
namespace {

// Spins until it is ready; false after a timeout. Measured by the clock: a pause takes 16 ns on some processors and 40
// on others.
template <class Ready>
bool wait_actively(std::chrono::microseconds limit, Ready&& ready) {
  if (limit.count() == 0) return ready();
  const auto end = std::chrono::steady_clock::now() + limit;
  do {
    for (int i = 0; i < 32; ++i) {
      if (ready()) return true;
      pause();
    }
  } while (std::chrono::steady_clock::now() < end);
  return false;
}

// A sleeper announces itself before it checks the condition; a waker changes the condition before it checks for
// sleepers (in one total order, std::memory_order_seq_cst). So one of them sees the other.
template <class Ready>
void sleep(const std::atomic<int>& changes, Ready&& ready) {
  for (;;) {
    const int before = changes.load();
    if (ready()) return;
    changes.wait(before);
  }
}

void wake(std::atomic<int>& changes) {
  ++changes;
  changes.notify_all();
}

int hardware_threads() { return static_cast<int>(std::max(1u, std::thread::hardware_concurrency())); }

}  // namespace

ThreadPool::Entry ThreadPool::Entry::of(std::uint64_t w) {
  return {static_cast<std::uint32_t>(w >> 32), ((w >> 31) & 1) != 0, static_cast<std::uint16_t>((w >> 16) & 0x7FFF),
          static_cast<std::uint16_t>(w & 0xFFFF)};
}

std::uint64_t ThreadPool::Entry::word() const {
  return std::uint64_t{job} << 32 | std::uint64_t{closed} << 31 | std::uint64_t{joined} << 16 | finished;
}

ThreadPool::ThreadPool(int threads)
    : count_(threads > 0 ? threads : hardware_threads()), forks_(forks()), affinity_(count_), begun_(count_ - 1) {
  // Longer than the serial parts between two jobs of a call, and than the time between two calls of a program that does
  // nothing else. More threads than cores would only delay each other.
  if (count_ <= hardware_threads()) awake_for_ = std::chrono::microseconds(200);
  try {
    for (int i = 1; i < count_; ++i) workers_.emplace_back([this, i] { work(i); });
  } catch (const std::system_error& e) {
    const std::size_t begun = workers_.size() + 1;
    end();
    throw std::runtime_error("threads: the system starts " + std::to_string(begun) + " of " + std::to_string(count_) +
                             " (" + e.code().message() +
                             "); ask for fewer, or let this process have more threads and memory (ulimit -u, -v)");
  } catch (...) {
    end();
    throw;
  }
  begun_.wait();
}

ThreadPool::~ThreadPool() { end(); }

void ThreadPool::end() {
  if (forks_ != forks()) {
    // Threads that do not exist can neither be joined nor detached, and their memory may be gone: only their handles
    // are reset.
    for (auto& w : workers_) std::construct_at(&w);
    return;
  }
  stop_ = true;
  wake(starts_);
  for (auto& w : workers_) w.join();
}

void ThreadPool::call(int thread) {
  try {
    (*job_)(thread);
  } catch (...) {
    std::lock_guard lock(error_lock_);
    if (!error_) error_ = std::current_exception();
  }
}

bool ThreadPool::new_job(std::uint32_t seen) const { return Entry::of(entry_.load()).job != seen || stop_.load(); }

void ThreadPool::wait_for_job(int thread, std::uint32_t seen) {
  affinity_.awake(thread);
  if (wait_actively(awake_for_, [&] { return new_job(seen); })) return;
  affinity_.asleep(thread);
  ++sleeping_;
  sleep(starts_, [&] { return new_job(seen); });
  --sleeping_;
  affinity_.woken(thread);
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
  // The run-time library allocates a thread's exception state when it is first needed. This must not be the first
  // throw, which may be that of a failed allocation: it would end the process.
  (void)std::current_exception();
  const StandardArithmetic arithmetic;  // a new thread inherits the mode of its creator
  begun_.count_down();
  std::uint32_t seen = 0;
  while (!stop_) {
    wait_for_job(thread, seen);
    if (!join(seen)) continue;
    call(thread);
    entry_.fetch_add(1);
    if (caller_sleeps_) wake(ends_);
  }
}

void ThreadPool::require_threads() const {
  if (!workers_.empty() && forks_ != forks())
    throw std::runtime_error("this detector's threads stayed in the process that made it; make one after the fork");
}

bool ThreadPool::finished(Join join) const {
  const Entry e = Entry::of(entry_.load());
  return e.finished == (join == Join::all ? workers_.size() : e.joined);
}

void ThreadPool::wait_for_threads(Join join) {
  if (wait_actively(awake_for_, [&] { return finished(join); })) return;
  caller_sleeps_ = true;
  sleep(ends_, [&] { return finished(join); });
  caller_sleeps_ = false;
}

void ThreadPool::run(const std::function<void(int)>& job, Join join) {
  if (workers_.empty()) return job(0);
  require_threads();
  job_ = &job;
  error_ = nullptr;
  entry_ = Entry{Entry::of(entry_.load()).job + 1, false, 0, 0}.word();
  const bool placed = affinity_.place(workers_);
  if (sleeping_ > 0) wake(starts_);
  call(0);
  if (placed) affinity_.free_late(workers_);
  if (join == Join::in_time) entry_.fetch_or(Entry{0, true, 0, 0}.word());
  wait_for_threads(join);
  if (auto error = std::exchange(error_, nullptr)) std::rethrow_exception(error);
}

}  // namespace hpccd
