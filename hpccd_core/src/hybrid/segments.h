// SPDX-License-Identifier: Apache-2.0
// The triangle index queue (Kim et al. 2009, section 5.1): segments of index pairs in one block of memory, filled by
// CPU threads, sent and emptied by the communication thread.
#pragma once

#include <atomic>
#include <cstddef>
#include <memory>
#include <optional>

#include "hybrid/test_device.h"

namespace hpccd::hybrid {

using SegmentNumber = std::size_t;

enum class SegmentState : unsigned char {
  empty,    // free to be given to a thread
  partial,  // held by a thread
  full,     // waits to be sent, or was sent and is not finished
};

// Consecutive segments that are sent with one call.
struct Run {
  SegmentNumber first;
  std::size_t segments, pairs;
};

class TriangleIndexQueue {
 public:
  // Memory for segments * segment_pairs pairs.
  TriangleIndexQueue(std::shared_ptr<LeafPair[]> memory, std::size_t segments, std::size_t segment_pairs);

  std::size_t size() const { return n_; }
  std::size_t segment_pairs() const { return segment_pairs_; }
  std::size_t window() const { return window_; }
  LeafPair* pairs(SegmentNumber s) const { return memory_.get() + s * segment_pairs_; }
  SegmentState state(SegmentNumber s) const { return segments_[s].state.load(std::memory_order_acquire); }
  std::size_t filled(SegmentNumber s) const { return segments_[s].filled; }

  // For the thread that holds the segment, with `filled` pairs in it: fewer than its capacity only if its traversal has
  // ended.
  void set_full(SegmentNumber s, std::size_t filled);

  // The rest is for the communication thread only.

  // The empty segment at the front pointer, now partial; the pointer advances to the next empty one.
  std::optional<SegmentNumber> pop_empty();
  // The first run of full segments in the window that have not been sent. The window moves to the end of the run;
  // without a run it moves by its own length, since partial segments are visited again when it comes back.
  std::optional<Run> pop_run();
  // The run is finished: its segments are empty again.
  void release(const Run& run);
  // All empty, whatever they were.
  void clear();

 private:
  struct alignas(64) Segment {
    std::atomic<SegmentState> state{SegmentState::empty};
    std::size_t filled = 0;
    bool sent = false;
  };
  bool can_be_sent(SegmentNumber s) const { return state(s) == SegmentState::full && !segments_[s].sent; }

  std::shared_ptr<LeafPair[]> memory_;
  std::size_t n_, segment_pairs_, window_;
  std::unique_ptr<Segment[]> segments_;
  SegmentNumber front_ = 0, window_begin_ = 0;
};

}  // namespace hpccd::hybrid
