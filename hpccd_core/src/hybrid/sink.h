// SPDX-License-Identifier: Apache-2.0
// The CPU thread's end of the triangle index queue: the thread fills one of its two segments while the other one is
// being sent, and tests half of a full segment itself if the devices lag behind (Kim et al. 2009, section 5.1, load
// balancing).
#pragma once

#include "hybrid/communication.h"
#include "traverse/worker.h"

namespace hpccd::hybrid {

class alignas(128) SegmentSink final : public PairSink {
 public:
  SegmentSink(TriangleIndexQueue& queue, SegmentSupply& supply, const Communication& communication)
      : queue_(queue), supply_(supply), communication_(communication) {}

  void begin() { given_back_ = without_segment_ = 0; }
  std::span<const LeafPair> push(LeafPair pair) override;
  void flush() override;
  // Drops its segment, since the queue was cleared.
  void reset();

  std::uint64_t given_back() const { return given_back_; }            // pairs that the thread must test itself
  std::uint64_t without_segment() const { return without_segment_; }  // times that no other segment was available yet

 private:
  bool begin_segment();
  std::span<const LeafPair> make_room();
  std::span<const LeafPair> give_back(std::size_t begin);
  void hand_over();

  TriangleIndexQueue& queue_;
  SegmentSupply& supply_;
  const Communication& communication_;
  std::optional<SegmentNumber> segment_;  // the current segment: never full
  LeafPair* pairs_ = nullptr;
  std::size_t n_ = 0;  // number of pairs in it
  LeafPair alone_{};   // without a segment: the last pair
  std::uint64_t given_back_ = 0, without_segment_ = 0;
};

}  // namespace hpccd::hybrid
