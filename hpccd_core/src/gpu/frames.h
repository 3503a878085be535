// SPDX-License-Identifier: Apache-2.0
// Frames on the GPU as a detector sees them: the device's part, the CPU's exact fallback beside it, one result.
// Where the device fails the frame is left to the caller, who finishes it on the CPU.
#pragma once

#include <functional>
#include <optional>

#include "base/parallel.h"
#include "base/profiler.h"
#include "bvh/motion_bounds.h"
#include "gpu/device.h"
#include "gpu/pipeline.h"

namespace hpccd::gpu {

class Frames {
 public:
  Frames(const Scene& scene, const Features& features, const Options& options, ThreadPool& pool);

  // A new tree over host positions; called for the first frame and where refitting has lost too much.
  using Build = std::function<const Tree&(Positions t0, Positions t1)>;

  // Nothing where the device failed: see last_error(). Throws InvalidArgument for bad coordinates.
  std::optional<Contacts> detect(Positions t0, Positions t1, const Build& build, Profiler& profiler);

  // Host arrays with the same positions.
  Positions on_host(Positions p, int which);

  // What the last frame counted, and how many frames so far were left to the CPU.
  std::map<std::string, std::uint64_t> stats() const;
  std::map<std::string, double> stages() const;
  std::uint64_t fallbacks() const { return fallbacks_; }
  const std::string& last_error() const { return last_error_; }
  // After so many failures in a row the device is left alone.
  bool gave_up() const { return failures_in_a_row_ >= 3; }

 private:
  Contacts frame(Positions t0, Positions t1, const Build& build, Profiler& profiler);
  Contacts join(const FrameResult& device, Positions t0, Positions t1);
  void add_outputs(Contacts& contacts, Positions t0, Positions t1);

  const Scene& scene_;
  const Features& features_;
  Options options_;
  ThreadPool& pool_;
  std::unique_ptr<Pipeline> pipeline_;
  bool has_tree_ = false;
  double area_when_built_ = 0;
  MotionBounds motion_;            // only where points or normals are asked for
  std::vector<Contact> exact_[2];  // by kind: decided by the CPU
  std::uint64_t fallbacks_ = 0;
  int failures_in_a_row_ = 0;
  std::string last_error_;
};

// Why the GPU cannot take a detector with these options; empty where it can.
std::string unsupported(const Options& options);

}  // namespace hpccd::gpu
