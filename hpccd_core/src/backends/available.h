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
  // Throws InvalidArgument if the options select a backend that is not usable, or results on a device without a usable
  // device.
  explicit AvailableBackends(Resources& shared);

  // The backend, for all worlds.
  DetectionBackend& at(Backend backend);
  CpuBackend& cpu() { return cpu_; }  // for one world
  GpuBackend& gpu() { return gpu_.value(); }
  // Whether the backend exists and its devices have not failed too often.
  bool works(Backend backend) const;
  bool use_devices() const { return gpu_ || hybrid_; }
  bool take_device_arrays() const { return gpu_.has_value(); }
  // Host arrays with the same positions. which: 0 or 1, the buffer for the copy.
  Positions on_host(Positions p, int which) { return gpu_ ? gpu_->on_host(p, which) : p; }

  // Adds the counts of the last step, for which this backend was requested.
  void count(Backend asked, std::map<std::string, std::uint64_t>& stats);
  // Why a step was left to the CPU.
  std::string last_error() const;

 private:
  CpuBackend cpu_;
  std::optional<GpuBackend> gpu_;
  std::optional<HybridBackend> hybrid_;
  // For several worlds: adapters from backends for one world to backends for all.
  std::optional<WorldMemories> memories_;
  std::optional<WorldsOnCpus> worlds_on_cpus_;
  std::optional<OneByOne> worlds_on_hybrid_;
};

}  // namespace hpccd
