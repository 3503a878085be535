// SPDX-License-Identifier: Apache-2.0
#include "backends/available.h"

#include "gpu/device.h"

namespace hpccd {
namespace {

bool wanted(Backend backend, const char* name, const std::string& unsupported, const Options& o) {
  const bool usable = !gpu::status().devices.empty();
  if (o.backend == Backend::automatic) return usable && unsupported.empty();
  if (o.backend != backend) return false;
  if (!unsupported.empty()) throw InvalidArgument(unsupported);
  if (!usable)
    throw InvalidArgument(std::string("backend: \"") + name + "\" is not usable here: " + gpu::status().reason +
                          "; use the CPU");
  return true;
}

// Without a device, not even results of the CPU could be copied to it.
void require_device_for_results(const Options& o) {
  if (o.results_on_device && gpu::status().devices.empty())
    throw InvalidArgument("results_on_device: needs a usable GPU, and there is none here (" + gpu::status().reason +
                          "); leave it false");
}

}  // namespace

AvailableBackends::AvailableBackends(Resources& shared) : cpu_(shared) {
  const Options& o = shared.options;
  require_device_for_results(o);
  if (wanted(Backend::gpu, "gpu", GpuBackend::unsupported(o), o)) gpu_.emplace(shared);
  if (wanted(Backend::hybrid, "hybrid", "", o)) hybrid_.emplace(shared, cpu_);
  if (o.worlds == 1) return;
  memories_.emplace(o.worlds);
  worlds_on_cpus_.emplace(shared, cpu_, *memories_);
  if (hybrid_) worlds_on_hybrid_.emplace(shared, *hybrid_, cpu_, *memories_);
}

DetectionBackend& AvailableBackends::at(Backend backend) {
  if (backend == Backend::gpu) return gpu_.value();
  if (worlds_on_cpus_ && backend == Backend::hybrid) return worlds_on_hybrid_.value();
  if (worlds_on_cpus_) return *worlds_on_cpus_;
  if (backend == Backend::hybrid) return hybrid_.value();
  return cpu_;
}

bool AvailableBackends::works(Backend backend) const {
  if (backend == Backend::gpu) return gpu_ && !gpu_->failures().gave_up();
  if (backend == Backend::hybrid) return hybrid_ && !hybrid_->failures().gave_up();
  return backend == Backend::cpu;
}

void AvailableBackends::count(Backend asked, std::map<std::string, std::uint64_t>& stats) {
  if (worlds_on_cpus_) {
    at(asked).count(stats);
  } else if (asked == Backend::gpu) {
    gpu_->count(stats);
  } else {
    cpu_.count(stats);
    if (hybrid_) hybrid_->count(stats);
  }
  if (use_devices())
    stats["gpu_fallbacks"] = (gpu_ ? gpu_->failures().count() : 0) + (hybrid_ ? hybrid_->failures().count() : 0);
}

std::string AvailableBackends::last_error() const {
  if (hybrid_ && !hybrid_->failures().last().empty()) return hybrid_->failures().last();
  return gpu_ ? gpu_->failures().last() : std::string();
}

}  // namespace hpccd
