// SPDX-License-Identifier: Apache-2.0
// A pool of threads that sleeps between jobs, and a parallel loop over it.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace hpccd {

class ThreadPool {
 public:
  explicit ThreadPool(int threads);  // the caller's thread is one of them; 0: all cores
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  int size() const { return static_cast<int>(workers_.size()) + 1; }

  // Runs job(thread number) on every thread and returns when all have finished. An exception of a job is rethrown here.
  void run(const std::function<void(int)>& job);

 private:
  void work(int thread);
  void call(int thread);

  std::vector<std::thread> workers_;
  std::mutex mutex_;
  std::condition_variable start_, done_;
  const std::function<void(int)>* job_ = nullptr;
  std::uint64_t generation_ = 0;
  int busy_ = 0;
  bool stop_ = false;
  std::exception_ptr error_;
};

// f(begin, end, thread) over [0, n) in pieces of at most `grain`, handed out in order by a counter.
template <class F>
void parallel_for(ThreadPool& pool, std::size_t n, std::size_t grain, F&& f) {
  if (n == 0) return;
  if (pool.size() == 1 || n <= grain) {
    f(std::size_t{0}, n, 0);
    return;
  }
  std::atomic<std::size_t> next{0};
  pool.run([&](int thread) {
    for (;;) {
      const std::size_t begin = next.fetch_add(grain, std::memory_order_relaxed);
      if (begin >= n) return;
      f(begin, begin + grain < n ? begin + grain : n, thread);
    }
  });
}

}  // namespace hpccd
