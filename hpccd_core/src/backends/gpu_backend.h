// SPDX-License-Identifier: Apache-2.0
// A whole step on one GPU; the CPU's exact fallback beside it.
#pragma once

#include <memory>
#include <string>

#include "backends/backend.h"
#include "backends/gpu_contacts.h"
#include "backends/resources.h"
#include "gpu/device.h"
#include "gpu/pipeline.h"

namespace hpccd {

class GpuBackend final : public DetectionBackend {
 public:
  explicit GpuBackend(Resources& shared) : shared_(shared) {}

  std::optional<Detection> detect(Positions t0, Positions t1) override;
  void count(std::map<std::string, std::uint64_t>& stats) const override;
  void add_stages(std::map<std::string, double>& stages) const override;

  // Host arrays with the same positions. which: 0 or 1, the place where a copy is kept.
  Positions on_host(Positions p, int which);

  // Why it cannot take a detector with these options; empty where it can.
  static std::string unsupported(const Options& options);

 private:
  Contacts compute(Positions t0, Positions t1);
  void update_tree(Positions t0, Positions t1);
  void decide(const std::vector<Candidate>& undecided, Positions t0, Positions t1);

  Resources& shared_;
  std::unique_ptr<gpu::Pipeline> pipeline_;
  bool has_tree_ = false;
  double area_when_built_ = 0;  // as the device measures it; 0: not known yet
  DecidedContacts decided_;
  MotionBounds motion_;  // only where points or normals are asked for
};

}  // namespace hpccd
