// SPDX-License-Identifier: Apache-2.0
#include "hybrid/segments.h"

#include <algorithm>
#include <utility>

namespace hpccd::hybrid {

TriangleIndexQueue::TriangleIndexQueue(std::shared_ptr<LeafPair[]> memory, std::size_t segments,
                                       std::size_t segment_pairs)
    : memory_(std::move(memory)),
      n_(segments),
      segment_pairs_(segment_pairs),
      window_(std::max<std::size_t>(1, segments / 4)),  // section 5.1: one fourth of the queue
      segments_(std::make_unique<Segment[]>(segments)) {}

void TriangleIndexQueue::set_full(SegmentNumber s, std::size_t filled) {
  segments_[s].filled = filled;
  segments_[s].state.store(SegmentState::full, std::memory_order_release);
}

std::optional<SegmentNumber> TriangleIndexQueue::pop_empty() {
  for (std::size_t i = 0; i < n_; ++i) {
    const SegmentNumber s = front_;
    front_ = (front_ + 1) % n_;
    if (state(s) != SegmentState::empty) continue;
    segments_[s].state.store(SegmentState::partial, std::memory_order_release);
    return s;
  }
  return std::nullopt;
}

std::optional<Run> TriangleIndexQueue::pop_run() {
  // A run ends at the end of the memory, and after a partial segment, whose pairs end there.
  for (std::size_t i = 0; i < window_; ++i) {
    const SegmentNumber first = (window_begin_ + i) % n_;
    if (!can_be_sent(first)) continue;
    Run run{first, 0, 0};
    bool joined = true;
    while (joined && i + run.segments < window_ && first + run.segments < n_ && can_be_sent(first + run.segments)) {
      Segment& s = segments_[first + run.segments];
      s.sent = true;
      ++run.segments;
      run.pairs += s.filled;
      joined = s.filled == segment_pairs_;
    }
    window_begin_ = (first + run.segments) % n_;
    return run;
  }
  window_begin_ = (window_begin_ + window_) % n_;
  return std::nullopt;
}

void TriangleIndexQueue::release(const Run& run) {
  for (SegmentNumber s = run.first; s < run.first + run.segments; ++s) {
    segments_[s].sent = false;
    segments_[s].state.store(SegmentState::empty, std::memory_order_release);
  }
}

void TriangleIndexQueue::clear() { release({0, n_, 0}); }

}  // namespace hpccd::hybrid
