// SPDX-License-Identifier: Apache-2.0
// Places threads on one core each. Linux puts two threads that are woken together on the same core, although another
// is idle, and leaves them there for a time slice: on four cores 369 of 400 wake-ups after a pause of 5 ms, at 0.8 ms
// for a job of 0.3. Therefore each thread is woken on a core of its own, and one that runs on another's core is moved.
// Both may be moved again once the job has begun: cores are shared with other processes, whose load the kernel knows.
#pragma once

#include <atomic>
#include <thread>
#include <vector>

#if defined(__linux__)
#include <sched.h>
#endif

#include "base/spin_lock.h"

namespace hpccd {

// Thread 0 distributes the jobs. On systems other than Linux, and if the call fails, nothing is done.
class ThreadAffinity {
 public:
  explicit ThreadAffinity(int threads) : places_(static_cast<std::size_t>(threads)) {}

  // Called by a thread: it runs; it goes to sleep; it was woken.
  void awake(int thread);
  void asleep(int thread);
  void woken(int thread);

  // Called by thread 0 before a job: binds those of `others` (1, 2, ...) that sleep, or that were last seen on another
  // thread's core, to an allowed core that no thread is known to use. False: nothing was done, for example because the
  // number of allowed cores differs from the number of threads: with fewer it is impossible, and with more the kernel
  // knows better which of them are siblings.
  bool place(std::vector<std::thread>& others);
  // Called by thread 0 when it has finished its part: another process may occupy the core to which a thread was bound.
  void free_late(std::vector<std::thread>& others);

 private:
#if defined(__linux__)
  // On a cache line of its own.
  struct alignas(64) Place {
    static constexpr int none = -1;
    std::atomic<int> core{none};  // where it was last seen; none: it sleeps
    bool misplaced = false;       // for place()
    SpinLock lock;                // of what follows
    bool bound = false;
    cpu_set_t free{};  // where it may run when it is no longer bound
  };
  bool find_misplaced(cpu_set_t& used);
#else
  struct Place {};
#endif
  std::vector<Place> places_;
};

}  // namespace hpccd
