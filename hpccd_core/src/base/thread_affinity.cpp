// SPDX-License-Identifier: Apache-2.0
#include "base/thread_affinity.h"

#if defined(__linux__)
#include <pthread.h>

#include <mutex>
#include <utility>
#endif

namespace hpccd {

#if defined(__linux__)

void ThreadAffinity::awake(int thread) {
  std::atomic<int>& core = places_[static_cast<std::size_t>(thread)].core;
  // Thread 0 reads it before each job: a redundant store would take the cache line away from it.
  if (const int now = sched_getcpu(); core.load(std::memory_order_relaxed) != now)
    core.store(now, std::memory_order_relaxed);
}

void ThreadAffinity::asleep(int thread) {
  places_[static_cast<std::size_t>(thread)].core.store(Place::none, std::memory_order_relaxed);
}

void ThreadAffinity::woken(int thread) {
  awake(thread);
  Place& place = places_[static_cast<std::size_t>(thread)];
  std::lock_guard lock(place.lock);
  if (std::exchange(place.bound, false)) pthread_setaffinity_np(pthread_self(), sizeof place.free, &place.free);
}

bool ThreadAffinity::find_misplaced(cpu_set_t& used) {
  bool any = false;
  CPU_ZERO(&used);
  for (Place& p : places_) {
    const int core = p.core.load(std::memory_order_relaxed);
    p.misplaced = core < 0 || core >= CPU_SETSIZE || CPU_ISSET(core, &used);
    if (!p.misplaced) CPU_SET(core, &used);
    any |= p.misplaced;
  }
  return any;
}

bool ThreadAffinity::place(std::vector<std::thread>& others) {
  awake(0);
  cpu_set_t used;
  if (!find_misplaced(used)) return false;
  cpu_set_t allowed;
  if (pthread_getaffinity_np(pthread_self(), sizeof allowed, &allowed) != 0) return false;
  if (static_cast<std::size_t>(CPU_COUNT(&allowed)) != places_.size()) return false;
  int core = 0;
  for (std::size_t i = 1; i < places_.size(); ++i) {
    Place& place = places_[i];
    if (!place.misplaced) continue;
    while (core < CPU_SETSIZE && (!CPU_ISSET(core, &allowed) || CPU_ISSET(core, &used))) ++core;
    if (core == CPU_SETSIZE) break;
    cpu_set_t one;
    CPU_ZERO(&one);
    CPU_SET(core++, &one);
    std::lock_guard lock(place.lock);
    place.free = allowed;
    place.bound = pthread_setaffinity_np(others[i - 1].native_handle(), sizeof one, &one) == 0;
  }
  return true;
}

void ThreadAffinity::free_late(std::vector<std::thread>& others) {
  for (std::size_t i = 1; i < places_.size(); ++i) {
    Place& place = places_[i];
    std::lock_guard lock(place.lock);
    if (std::exchange(place.bound, false))
      pthread_setaffinity_np(others[i - 1].native_handle(), sizeof place.free, &place.free);
  }
}

#else

void ThreadAffinity::awake(int) {}
void ThreadAffinity::asleep(int) {}
void ThreadAffinity::woken(int) {}
bool ThreadAffinity::place(std::vector<std::thread>&) { return false; }
void ThreadAffinity::free_late(std::vector<std::thread>&) {}

#endif

}  // namespace hpccd
