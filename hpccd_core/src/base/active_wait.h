// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <thread>

namespace hpccd {

// One turn of active waiting: 15 to 50 ns on x86-64, leaving the core's resources to a sibling thread. On aarch64 isb:
// what stands for it there, yield, does nothing on most cores, and a turn would be over at once.
inline void pause() {
#if defined(__x86_64__)
  __builtin_ia32_pause();
#elif defined(__aarch64__)
  __asm__ __volatile__("isb" ::: "memory");
#else
  std::this_thread::yield();
#endif
}

// Active waiting for what should take a moment. Where it takes longer (the other thread was interrupted, or is long in
// exact arithmetic), the core is left to others.
class ActiveWait {
 public:
  // What was waited for came: the next wait is a new one.
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
  static constexpr int patience = 4000;  // 60 to 200 us, as a pool waits for its next job (parallel.cpp)
  int turns_ = 0;
};

}  // namespace hpccd
