// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <thread>

namespace hpccd {

// One iteration of spinning: 15 to 50 ns on x86-64, leaving the core's resources to a sibling thread. On aarch64 isb:
// the equivalent instruction, yield, does nothing on most cores and would return at once.
inline void pause() {
#if defined(__x86_64__)
  __builtin_ia32_pause();
#elif defined(__aarch64__)
  __asm__ __volatile__("isb" ::: "memory");
#else
  std::this_thread::yield();
#endif
}

// Spins for an event that should occur soon. If it takes longer (the other thread was interrupted, or is in a long
// exact computation), the core is released to other threads.
class ActiveWait {
 public:
  // The event has occurred: the next wait starts from zero.
  void reset() { turns_ = 0; }
  void turn() {
    if (turns_ < patience) {
      ++turns_;
      pause();
    } else {
      std::this_thread::yield();
    }
  }

 private:
  static constexpr int patience = 4000;  // 60 to 200 us, as long as a pool waits for its next job (parallel.cpp)
  int turns_ = 0;
};

}  // namespace hpccd
