// SPDX-License-Identifier: Apache-2.0
#include "hybrid/sink.h"

namespace hpccd::hybrid {

std::span<const LeafPair> SegmentSink::push(LeafPair pair) {
  if (!segment_ && !begin_segment()) {
    alone_ = pair;
    ++given_back_;
    return {&alone_, 1};
  }
  pairs_[n_++] = pair;
  if (n_ < queue_.segment_pairs()) return {};
  return make_room();
}

// False: no segment was handed out, or the devices no longer accept pairs.
bool SegmentSink::begin_segment() {
  if (communication_.failed()) return false;
  segment_ = supply_.receive();
  if (!segment_) return false;
  pairs_ = queue_.pairs(*segment_);
  n_ = 0;
  return true;
}

std::span<const LeafPair> SegmentSink::make_room() {
  if (communication_.failed()) return give_back(0);
  // Half of the segment stays for the devices; the thread continues to fill the other half.
  if (communication_.devices_lag()) return give_back(n_ / 2);
  const auto other = supply_.receive();
  if (!other) {
    ++without_segment_;
    return give_back(n_ / 2);
  }
  hand_over();
  segment_ = other;
  pairs_ = queue_.pairs(*other);
  return {};
}

std::span<const LeafPair> SegmentSink::give_back(std::size_t begin) {
  const std::span<const LeafPair> back(pairs_ + begin, n_ - begin);
  given_back_ += back.size();
  n_ = begin;
  return back;
}

void SegmentSink::flush() {
  if (segment_ && n_ > 0) hand_over();
}

void SegmentSink::hand_over() {
  queue_.set_full(*segment_, n_);
  supply_.request();
  reset();
}

void SegmentSink::reset() {
  segment_.reset();
  n_ = 0;
}

}  // namespace hpccd::hybrid
