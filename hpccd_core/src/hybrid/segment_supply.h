// SPDX-License-Identifier: Apache-2.0
// Transfers empty segments from the communication thread to a CPU thread, without either waiting.
#pragma once

#include <atomic>
#include <optional>

#include "hybrid/segments.h"

namespace hpccd::hybrid {

class alignas(64) SegmentSupply {
 public:
  // For the CPU thread.
  void request() { wanted_.fetch_add(1, std::memory_order_release); }
  std::optional<SegmentNumber> receive() {
    for (auto& place : places_)
      if (const SegmentNumber s = place.exchange(none, std::memory_order_acquire); s != none) return s;
    return std::nullopt;
  }

  // For the communication thread.
  bool wanted() const { return wanted_.load(std::memory_order_acquire) > 0; }
  void give(SegmentNumber s) {
    wanted_.fetch_sub(1, std::memory_order_relaxed);
    for (auto& place : places_) {
      SegmentNumber nothing = none;
      if (place.compare_exchange_strong(nothing, s, std::memory_order_release)) return;
    }
  }
  // While no CPU thread is working: as initially, two segments are requested.
  void reset() {
    for (auto& place : places_) place = none;
    wanted_ = 2;
  }

 private:
  static constexpr SegmentNumber none = static_cast<SegmentNumber>(-1);
  std::atomic<int> wanted_{2};
  std::atomic<SegmentNumber> places_[2] = {none, none};  // a thread has at most two under way to it
};

}  // namespace hpccd::hybrid
