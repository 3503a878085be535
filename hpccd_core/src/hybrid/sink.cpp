// SPDX-License-Identifier: Apache-2.0
#include "hybrid/sink.h"

namespace hpccd::hybrid {

void SegmentSink::begin(const TestHere& test_here) {
  test_here_ = &test_here;
  tested_here_ = without_segment_ = 0;
}

void SegmentSink::take(std::uint32_t a, std::uint32_t b, Worker& worker) {
  if (n_ == end_) make_room(worker);
  if (n_ == end_) {  // no segment: nothing was handed out, or nobody takes it any more
    ++tested_here_;
    (*test_here_)(worker, {a, b});
    return;
  }
  pairs_[n_++] = {a, b};
}

void SegmentSink::make_room(Worker& worker) {
  if (communication_.failed()) {
    if (segment_) test_here(0, worker);
    return;
  }
  if (!segment_) {
    segment_ = supply_.take();
    if (!segment_) return;
    pairs_ = queue_.pairs(*segment_);
    n_ = 0, end_ = queue_.segment_pairs();
    return;
  }
  // Half of the segment stays for the devices; the thread goes on filling the other half.
  if (communication_.devices_lag()) return test_here(end_ / 2, worker);
  const auto other = supply_.take();
  if (!other) {
    ++without_segment_;
    return test_here(end_ / 2, worker);
  }
  hand_over();
  segment_ = other;
  pairs_ = queue_.pairs(*other);
  n_ = 0, end_ = queue_.segment_pairs();
}

void SegmentSink::flush() {
  if (segment_ && n_ > 0) hand_over();
}

void SegmentSink::hand_over() {
  queue_.set_full(*segment_, n_);
  supply_.request();
  segment_.reset();
  n_ = end_ = 0;
}

void SegmentSink::reset() {
  segment_.reset();
  n_ = end_ = 0;
}

void SegmentSink::test_here(std::size_t begin, Worker& worker) {
  for (std::size_t i = begin; i < n_; ++i) (*test_here_)(worker, pairs_[i]);
  tested_here_ += n_ - begin;
  n_ = begin;
}

}  // namespace hpccd::hybrid
