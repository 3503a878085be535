// SPDX-License-Identifier: Apache-2.0
// The master CPU-GPU communication thread (Kim et al. 2009, section 5.1): sends runs of full segments to the devices,
// collects their results, and hands out empty segments. No other thread communicates with the devices.
#pragma once

#include <atomic>
#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "hybrid/segment_supply.h"

namespace hpccd::hybrid {

struct CommunicationCounts {
  std::uint64_t elements = 0;     // of the GPU task queue: calls that sent segments
  std::uint64_t segments = 0;     // sent
  std::uint64_t most_queued = 0;  // segments at a time
};

class Communication {
 public:
  using Devices = std::vector<std::unique_ptr<TestDevice>>;
  Communication(Devices& devices, TriangleIndexQueue& queue, std::vector<SegmentSupply>& supplies);
  ~Communication();
  Communication(const Communication&) = delete;
  Communication& operator=(const Communication&) = delete;

  // Called in this order in each frame, from one thread; the first two return immediately.
  void begin_frame(Positions t0, Positions t1);
  void begin_traversal(const LeafTable& leaves);
  // All segments must be full: returns when the devices have finished, or failed.
  void finish();
  // Instead of finish, at any time in a frame: returns when the frame's positions are no longer in use.
  void cancel();

  // Whether the devices lag behind: more segments are in the GPU task queue than the GPUs have cores (multiprocessors).
  bool devices_lag() const { return queued_.load(std::memory_order_relaxed) > cores_; }
  // Set as soon as a device has failed in this frame; then nothing more is sent.
  bool failed() const { return failed_.load(std::memory_order_acquire); }

  // After finish().
  const std::string& error() const { return error_; }
  const Output& output() const { return output_; }
  const CommunicationCounts& counts() const { return counts_; }

 private:
  enum class Stage : int { idle, positions, traversal, draining, canceled, stop };
  struct Element {  // of the GPU task queue
    std::vector<Run> runs;
    std::size_t device;
    Ticket ticket;
    std::size_t segments() const;
  };

  void order(Stage stage);
  void wait_until_idle();
  void work();
  void frame();
  void wait_for_traversal();
  bool send(bool traversal_has_ended);
  std::vector<Run> pop_runs(bool all);
  bool collect_ready();
  bool hand_out();

  Devices& devices_;
  TriangleIndexQueue& queue_;
  std::vector<SegmentSupply>& supplies_;
  std::size_t cores_ = 0;

  Positions t0_, t1_;
  LeafTable leaves_;
  std::deque<Element> elements_;
  std::vector<std::size_t> under_way_;  // by device
  std::atomic<std::size_t> queued_{0};
  std::atomic<bool> failed_{false};
  Output output_;
  CommunicationCounts counts_;
  std::string error_;

  std::mutex mutex_;
  std::condition_variable changed_;
  std::atomic<Stage> stage_{Stage::idle};
  std::thread thread_;
};

}  // namespace hpccd::hybrid
