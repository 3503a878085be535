// SPDX-License-Identifier: Apache-2.0
// Dynamic task reassignment (Kim et al. 2009, section 4.3): a thread without task units requests work from the thread
// whose front node covers the most triangles, and sleeps until it receives nodes. Locks are taken only by threads that
// have run out of work or give work away, never in the main loop.
#pragma once

#include <atomic>
#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "paper/hierarchy.h"

namespace hpccd::paper {

using TaskUnitQueue = std::deque<NodeIndex>;

class Scheduling {
 public:
  explicit Scheduling(int threads);

  void begin();  // before a traversal, on one thread: all threads have work

  // The number of triangles of the node at the front of the thread's task unit queue, for others to see; 0: none.
  void show_front(int thread, std::uint32_t triangles);
  // Whether the thread's scheduling queue holds requests: a look at its size, without a lock.
  bool requested(int thread) const;
  // Gives the front nodes of the thread's queue to those who asked, one each, and keeps at least one node itself.
  // Who gets none goes on waiting. Returns the number of nodes given.
  std::uint32_t distribute(int thread, TaskUnitQueue& units);
  // For a thread whose queue is empty: waits for nodes; false when no thread has any left.
  bool request(int thread, TaskUnitQueue& units);
  // For a thread that ends early: nobody waits for it any longer. Takes no memory, which may be why it ends.
  void leave(int thread);

 private:
  struct Message {
    bool has_node;
    NodeIndex node;
  };
  struct alignas(64) Slot {
    std::atomic<std::uint32_t> front_triangles{0};
    std::atomic<std::uint32_t> n_requests{0};
    std::atomic<bool> open{false};  // has work, answers requests; changed under the mutex
    std::mutex mutex;               // of the scheduling queue
    std::vector<int> requests;      // the scheduling queue: the threads that asked, each once; has room for all
    std::mutex message_mutex;
    std::condition_variable woken;
    std::optional<Message> message;  // to a thread that has asked one other
  };

  int distribution_thread(int requesting) const;
  bool place_request(int thread, int distributing);
  void wake(int thread, Message message);

  std::vector<std::unique_ptr<Slot>> slots_;
  std::atomic<int> active_{0};  // threads that have work, or to whom work is on its way
};

}  // namespace hpccd::paper
