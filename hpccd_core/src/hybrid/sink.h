// SPDX-License-Identifier: Apache-2.0
// A CPU thread's end of the triangle index queue: it fills one of its two segments while another one is on its way, and
// tests half of a full segment itself where the devices lag behind (Kim et al. 2009, section 5.1, load balancing).
#pragma once

#include <functional>

#include "hybrid/communication.h"
#include "traverse/worker.h"

namespace hpccd::hybrid {

// Performs the elementary tests of two leaves on the calling thread.
using TestHere = std::function<void(Worker&, IndexPair)>;

class alignas(128) SegmentSink final : public PairSink {
 public:
  SegmentSink(TriangleIndexQueue& queue, SegmentSupply& supply, const Communication& communication)
      : queue_(queue), supply_(supply), communication_(communication) {}

  void begin(const TestHere& test_here);
  void take(std::uint32_t a, std::uint32_t b, Worker& worker) override;
  void flush() override;
  // Forgets its segment: the queue was cleared.
  void reset();

  std::uint64_t tested_here() const { return tested_here_; }          // pairs
  std::uint64_t without_segment() const { return without_segment_; }  // times that no other segment was there yet

 private:
  void make_room(Worker& worker);
  void hand_over();
  void test_here(std::size_t begin, Worker& worker);

  TriangleIndexQueue& queue_;
  SegmentSupply& supply_;
  const Communication& communication_;
  const TestHere* test_here_ = nullptr;
  std::optional<SegmentNumber> segment_;  // at work
  IndexPair* pairs_ = nullptr;
  std::size_t n_ = 0, end_ = 0;  // filled, and where it is full; 0: no segment at work
  std::uint64_t tested_here_ = 0, without_segment_ = 0;
};

}  // namespace hpccd::hybrid
