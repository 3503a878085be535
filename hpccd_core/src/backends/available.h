// SPDX-License-Identifier: Apache-2.0
// The backends of one detector: those that its options allow and this machine has.
#pragma once

#include <map>
#include <optional>
#include <string>

#include "backends/cpu_backend.h"
#include "backends/gpu_backend.h"
#include "backends/hybrid_backend.h"
#include "backends/one_by_one.h"
#include "backends/worlds_on_cpus.h"

namespace hpccd {

class AvailableBackends {
 public:
  // Throws InvalidArgument where the options ask for a backend that is not usable, or for results on a device that is
  // not there.
  explicit AvailableBackends(Resources& shared);

  // It takes all worlds.
  DetectionBackend& at(Backend backend);
  GpuBackend& gpu() { return gpu_.value(); }
  // Whether it is here, and its devices have not failed too often.
  bool works(Backend backend) const;
  bool use_devices() const { return gpu_ || hybrid_; }
  bool take_device_arrays() const { return gpu_.has_value(); }
  // Host arrays with the same positions. which: 0 or 1, the place where a copy is kept.
  Positions on_host(Positions p, int which) { return gpu_ ? gpu_->on_host(p, which) : p; }

  // Of a last step for which this one was asked.
  void count(Backend asked, std::map<std::string, std::uint64_t>& stats);
  // Why a step was left to the CPU.
  std::string last_error() const;

 private:
  CpuBackend cpu_;
  std::optional<GpuBackend> gpu_;
  std::optional<HybridBackend> hybrid_;
  // Of several worlds, what makes of those that take one backends that take all.
  std::optional<WorldMemories> memories_;
  std::optional<WorldsOnCpus> worlds_on_cpus_;
  std::optional<OneByOne> worlds_on_hybrid_;
};

}  // namespace hpccd
