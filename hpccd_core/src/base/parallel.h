// SPDX-License-Identifier: Apache-2.0
// A pool of threads and a parallel loop over it. Between the jobs of one call threads spin briefly, since waking a
// sleeping thread (about 50 us) costs more than many jobs take. Between calls they sleep on one futex per side
// (std::atomic::wait): the mutex of a condition variable would put threads that wake together to sleep again
// (spin_lock.h).
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <exception>
#include <functional>
#include <latch>
#include <thread>
#include <vector>

#include "base/cancellation.h"
#include "base/spin_lock.h"
#include "base/thread_affinity.h"

namespace hpccd {

class ThreadPool {
 public:
  // The caller's thread is one of them; 0: all cores. Throws std::runtime_error if the system cannot start them.
  explicit ThreadPool(int threads);
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  // On a cache line of its own.
  struct alignas(64) Counter {
    std::atomic<std::size_t> value{0};
  };

  int size() const { return count_; }
  // Throws std::runtime_error in a child made by fork(), which has only the caller's thread.
  void require_threads() const;

  // From now on parallel_for ends with Cancelled if requested.
  void heed(const Cancellation& cancellation) { cancellation_ = &cancellation; }
  const Cancellation& cancellation() const { return *cancellation_; }

  // Runs job(thread number) once on every thread and returns when all have finished. An exception of a job is rethrown
  // here.
  void run(const std::function<void(int)>& job) { run(job, Join::all); }
  // The same on the calling thread and on those that arrive before it has finished: for jobs with a common queue of
  // work, so that the caller does not wait for a thread that wakes up when nothing is left to do.
  void share(const std::function<void(int)>& job) { run(job, Join::in_time); }

 private:
  enum class Join { all, in_time };
  // The state of a job in one word: its number, whether it still accepts threads, how many have joined and finished.
  struct Entry {
    std::uint32_t job;
    bool closed;
    std::uint16_t joined, finished;
    static Entry of(std::uint64_t word);
    std::uint64_t word() const;
  };

  void run(const std::function<void(int)>& job, Join join);
  void end();
  void work(int thread);
  void call(int thread);
  bool join(std::uint32_t& seen);
  void wait_for_job(int thread, std::uint32_t seen);
  bool new_job(std::uint32_t seen) const;
  void wait_for_threads(Join join);
  bool finished(Join join) const;

  int count_, forks_;  // number of threads; forks() when it was created
  std::vector<std::thread> workers_;
  const Cancellation* cancellation_ = &never_cancelled;
  const std::function<void(int)>* job_ = nullptr;
  std::atomic<std::uint64_t> entry_{0};
  std::atomic<bool> stop_{false};
  std::chrono::microseconds awake_for_{0};
  std::atomic<int> starts_{0}, ends_{0};  // change when there is a reason to wake up
  std::atomic<int> sleeping_{0};
  ThreadAffinity affinity_;
  std::latch begun_;  // each of the workers
  std::atomic<bool> caller_sleeps_{false};
  SpinLock error_lock_;
  std::exception_ptr error_;
};

// f(begin, end, thread) over [0, n) in pieces of at most `grain`. Each thread begins with its own part of the range and
// then helps the others: data that an earlier loop over the same range has brought into a core's cache is mostly still
// there.
template <class F>
void parallel_for(ThreadPool& pool, std::size_t n, std::size_t grain, F&& f) {
  if (n == 0) return;
  if (pool.size() == 1 || n <= grain) {
    in_pieces(pool.cancellation(), n, grain, [&](std::size_t begin, std::size_t end) { f(begin, end, 0); });
    return;
  }
  const auto threads = static_cast<std::size_t>(pool.size());
  const std::size_t pieces = (n + grain - 1) / grain;
  const auto first_piece = [&](std::size_t part) { return pieces * part / threads; };
  std::vector<ThreadPool::Counter> next(threads);
  for (std::size_t part = 0; part < threads; ++part)
    next[part].value.store(first_piece(part), std::memory_order_relaxed);
  pool.share([&](int thread) {
    for (std::size_t i = 0; i < threads; ++i) {
      const std::size_t part = (static_cast<std::size_t>(thread) + i) % threads, end = first_piece(part + 1);
      for (;;) {
        const std::size_t piece = next[part].value.fetch_add(1, std::memory_order_relaxed);
        if (piece >= end) break;
        pool.cancellation().heed();
        f(piece * grain, piece * grain + grain < n ? piece * grain + grain : n, thread);
      }
    }
  });
}

// f(i) for each i < n, one at a time.
template <class F>
void parallel_for_each(ThreadPool& pool, std::size_t n, F&& f) {
  parallel_for(pool, n, 1, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t i = begin; i < end; ++i) f(i);
  });
}

}  // namespace hpccd
