// SPDX-License-Identifier: Apache-2.0
// Frames of the hybrid backend on this machine's GPUs, beside the detector's own bounds, hierarchy and traversal.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "hybrid/engine.h"
#include "scene/features.h"
#include "traverse/tasks.h"

namespace hpccd::hybrid {

class Frames {
 public:
  Frames(const Scene& scene, const Features& features, const PairRules& rules, const Options& options,
         ThreadPool& pool);

  // Positions begin to travel to the devices. Nothing where there is no device to use: see last_error().
  std::unique_ptr<FrameGuard> begin(Positions t0, Positions t1, std::vector<Worker>& workers, Profiler& profiler);
  // Workers that walk the tree, or a published method's hierarchy, leave its pairs to the devices.
  void traverse(const Tree& tree, std::uint64_t builds, std::vector<Worker>& workers);
  void traverse_primitives(std::vector<Worker>& workers);
  // Afterwards the workers hold all contacts. False: devices failed and the CPU did the rest.
  using Test = std::function<void(LeafPair, Worker&)>;
  bool finish(FrameGuard& frame, std::vector<Worker>& workers, const Test& test, Profiler& profiler);

  void count(std::map<std::string, std::uint64_t>& stats) const;
  std::uint64_t fallbacks() const { return fallbacks_; }
  const std::string& last_error() const { return last_error_; }
  bool gave_up() const { return failures_in_a_row_ >= 3; }

 private:
  void note_failure(const std::string& error);
  void list_primitives();

  const Scene& scene_;
  const Features& features_;
  const PairRules& rules_;
  const Options options_;
  ThreadPool& pool_;
  std::unique_ptr<Engine> engine_;
  // For the published methods: each primitive a leaf of its own.
  std::vector<LeafRange> primitives_;
  std::vector<std::uint32_t> face_of_primitive_;
  std::uint64_t fallbacks_ = 0;
  int failures_in_a_row_ = 0;
  std::string last_error_;
};

// Why the hybrid backend cannot take a detector with these options; empty where it can.
std::string unsupported(const Options& options);

}  // namespace hpccd::hybrid
