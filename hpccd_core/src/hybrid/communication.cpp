// SPDX-License-Identifier: Apache-2.0
#include "hybrid/communication.h"

#include <algorithm>
#include <exception>
#include <utility>

#include "base/active_wait.h"
#include "base/standard_arithmetic.h"

namespace hpccd::hybrid {

Communication::Communication(Devices& devices, TriangleIndexQueue& queue, std::vector<SegmentSupply>& supplies)
    : devices_(devices), queue_(queue), supplies_(supplies), under_way_(devices.size(), 0) {
  for (const auto& device : devices_) cores_ += device->cores();
  thread_ = std::thread([this] { work(); });
}

Communication::~Communication() {
  cancel();
  order(Stage::stop);
  thread_.join();
}

void Communication::order(Stage stage) {
  {
    std::lock_guard lock(mutex_);
    stage_ = stage;
  }
  changed_.notify_all();
}

void Communication::begin_frame(Positions t0, Positions t1) {
  wait_until_idle();
  t0_ = t0, t1_ = t1;
  failed_ = false;
  error_.clear();
  output_.vertex_face.clear();
  output_.edge_edge.clear();
  output_.undecided.clear();
  output_.counts[0] = output_.counts[1] = {};
  counts_ = {};
  order(Stage::positions);
}

void Communication::begin_traversal(const LeafTable& leaves) {
  leaves_ = leaves;
  order(Stage::traversal);
}

void Communication::finish() {
  order(Stage::draining);
  wait_until_idle();
}

void Communication::cancel() {
  if (stage_ != Stage::idle) order(Stage::canceled);
  wait_until_idle();
}

void Communication::wait_until_idle() {
  for (ActiveWait wait; stage_.load(std::memory_order_acquire) != Stage::idle;) wait.turn();
}

void Communication::work() {
  const StandardArithmetic arithmetic;
  for (;;) {
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] { return stage_ != Stage::idle; });
    }
    if (stage_ == Stage::stop) return;
    try {
      frame();
    } catch (const std::exception& e) {
      error_ = e.what();
      failed_.store(true, std::memory_order_release);
    }
    if (failed_ || stage_ == Stage::canceled) {
      for (auto& device : devices_) device->cancel();
      elements_.clear();
      std::fill(under_way_.begin(), under_way_.end(), std::size_t{0});
      queued_ = 0;
    }
    // The frame continues without this thread until the caller is informed.
    for (ActiveWait wait; stage_ != Stage::draining && stage_ != Stage::canceled;) wait.turn();
    stage_.store(Stage::idle, std::memory_order_release);
  }
}

void Communication::frame() {
  for (auto& device : devices_) device->begin_frame(t0_, t1_);
  wait_for_traversal();
  if (stage_ == Stage::canceled) return;
  for (auto& device : devices_) device->begin_traversal(leaves_);
  ActiveWait wait;
  for (std::size_t turns_without = 0;;) {
    // Read first: segments that are found later in a whole round of the window were full before.
    const Stage stage = stage_.load(std::memory_order_acquire);
    if (stage == Stage::canceled) return;
    const bool sent = send(stage == Stage::draining), taken = collect_ready(), handed = hand_out();
    if (sent || taken || handed)
      turns_without = 0, wait.reset();
    else
      ++turns_without, wait.turn();
    if (stage != Stage::draining) turns_without = 0;
    const std::size_t round = queue_.size() / queue_.window() + 1;
    if (elements_.empty() && turns_without > round) return;
  }
}

void Communication::wait_for_traversal() {
  // Threads request segments before the traversal begins, and each gets its two.
  for (ActiveWait wait; stage_ == Stage::positions;)
    if (!hand_out()) wait.turn();
}

std::size_t Communication::Element::segments() const {
  std::size_t n = 0;
  for (const Run& run : runs) n += run.segments;
  return n;
}

// One run of consecutive segments, as published. When the traversal has ended, all remaining segments are sent
// together: partial segments may be anywhere, and one call for each would delay the frame.
std::vector<Run> Communication::pop_runs(bool all) {
  std::vector<Run> runs;
  for (std::size_t looks = all ? queue_.size() / queue_.window() + 1 : 1; looks > 0; --looks)
    while (const auto run = queue_.pop_run()) {
      runs.push_back(*run);
      if (!all) break;
    }
  return runs;
}

bool Communication::send(bool traversal_has_ended) {
  std::size_t best = devices_.size();
  for (std::size_t i = 0; i < devices_.size(); ++i)
    if (under_way_[i] < devices_[i]->slots() && (best == devices_.size() || under_way_[i] < under_way_[best])) best = i;
  if (best == devices_.size()) return false;
  std::vector<Run> runs = pop_runs(traversal_has_ended);
  if (runs.empty()) return false;
  std::vector<Piece> pieces;
  for (const Run& run : runs) pieces.push_back({queue_.pairs(run.first), run.pairs});
  const Ticket ticket = devices_[best]->submit(pieces);
  elements_.push_back({std::move(runs), best, ticket});
  ++under_way_[best];
  const std::size_t segments = elements_.back().segments();
  queued_.fetch_add(segments, std::memory_order_relaxed);
  ++counts_.elements;
  counts_.segments += segments;
  counts_.most_queued = std::max<std::uint64_t>(counts_.most_queued, queued_);
  return true;
}

bool Communication::collect_ready() {
  bool any = false;
  for (auto e = elements_.begin(); e != elements_.end();) {
    if (!devices_[e->device]->ready(e->ticket)) {
      ++e;
      continue;
    }
    devices_[e->device]->collect(e->ticket, output_);
    for (const Run& run : e->runs) queue_.release(run);
    queued_.fetch_sub(e->segments(), std::memory_order_relaxed);
    --under_way_[e->device];
    e = elements_.erase(e);
    any = true;
  }
  return any;
}

bool Communication::hand_out() {
  bool any = false;
  for (SegmentSupply& supply : supplies_)
    while (supply.wanted()) {
      const auto s = queue_.pop_empty();
      if (!s) return any;
      supply.give(*s);
      any = true;
    }
  return any;
}

}  // namespace hpccd::hybrid
