// SPDX-License-Identifier: Apache-2.0
// Section 5 of Kim et al. 2009, as used by the detector: positions are sent while the hierarchy is refitted, the
// traversal of the CPU threads hands pairs of leaves to the devices, and the devices' contacts are merged with those
// of the threads. Work that a failed device leaves is returned to the threads: no contact is lost.
#pragma once

#include <deque>

#include "base/parallel.h"
#include "base/profiler.h"
#include "hybrid/sink.h"

namespace hpccd::hybrid {

struct Sizes {
  std::size_t segments = 128, segment_pairs = 2048;
};

// The work that the devices leave to the caller: none, unless one has failed.
struct Finished {
  bool complete;                   // false: see Engine::error()
  std::vector<LeafPair> untested;  // to be tested by the caller
};

class Engine {
 public:
  // Requires at least one device. Queues that are too short for the threads (four segments each) are lengthened.
  Engine(Communication::Devices devices, const Sizes& sizes, ThreadPool& pool);

  // Returns immediately. The positions must not change until finish() or cancel() has returned.
  void begin_frame(Positions t0, Positions t1) { communication_.begin_frame(t0, t1); }
  // From now on the workers' pairs go to the devices.
  void begin_traversal(const LeafTable& leaves, std::vector<Worker>& workers);
  // Waits for the devices; afterwards the workers hold the contacts.
  Finished finish(std::vector<Worker>& workers, Profiler& profiler);
  // For a frame that cannot continue.
  void cancel(std::vector<Worker>& workers);

  const std::string& error() const { return communication_.error(); }
  void count(std::map<std::string, std::uint64_t>& stats) const;

 private:
  std::vector<LeafPair> untested() const;
  void merge(std::vector<Worker>& workers);
  void reset();

  Communication::Devices devices_;
  TriangleIndexQueue queue_;
  std::vector<SegmentSupply> supplies_;
  Communication communication_;
  std::deque<SegmentSink> sinks_;
  ThreadPool& pool_;
  std::uint64_t pairs_on_cpu_ = 0, without_segment_ = 0, exact_on_cpu_ = 0;
};

// The elementary tests of a frame that may end early.
class FrameGuard {
 public:
  FrameGuard(Engine& engine, std::vector<Worker>& workers) : engine_(engine), workers_(workers) {}
  ~FrameGuard() {
    if (!done_) engine_.cancel(workers_);
  }
  FrameGuard(const FrameGuard&) = delete;
  FrameGuard& operator=(const FrameGuard&) = delete;
  Finished finish(Profiler& profiler) {
    done_ = true;
    return engine_.finish(workers_, profiler);
  }

 private:
  Engine& engine_;
  std::vector<Worker>& workers_;
  bool done_ = false;
};

}  // namespace hpccd::hybrid
