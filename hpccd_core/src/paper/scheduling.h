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

  // Publishes the number of triangles of the node at the front of the thread's task unit queue; 0: none.
  void show_front(int thread, std::uint32_t triangles);
  // Whether the thread's scheduling queue contains requests: reads its size, without a lock.
  bool requested(int thread) const;
  // Gives the front nodes of the thread's queue to the requesting threads, one each, and keeps at least one node.
  // Threads that get none continue to wait. Returns the number of nodes given.
  std::uint32_t distribute(int thread, TaskUnitQueue& units);
  // For a thread whose queue is empty: waits for nodes; false if no thread has any left.
  bool request(int thread, TaskUnitQueue& units);
  // For a thread that ends early: no thread waits for it any longer. Allocates no memory, since the lack of it may be
  // the reason.
  void leave(int thread);

 private:
  struct Message {
    bool has_node;
    NodeIndex node;
  };
  struct alignas(64) Slot {
    std::atomic<std::uint32_t> front_triangles{0};
    std::atomic<std::uint32_t> n_requests{0};
    std::atomic<bool> open{false};  // has work and serves requests; changed under the mutex
    std::mutex mutex;               // of the scheduling queue
    std::vector<int> requests;      // the scheduling queue: the requesting threads, each once; has room for all
    std::mutex message_mutex;
    std::condition_variable woken;
    std::optional<Message> message;  // to a thread that has asked one other
  };

  int distribution_thread(int requesting) const;
  bool place_request(int thread, int distributing);
  void wake(int thread, Message message);

  std::vector<std::unique_ptr<Slot>> slots_;
  std::atomic<int> active_{0};  // threads that have work, or to which work is being transferred
};

}  // namespace hpccd::paper
