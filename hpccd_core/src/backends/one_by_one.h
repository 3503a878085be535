// SPDX-License-Identifier: Apache-2.0
// Computes many worlds one after the other with a backend for one world, for devices that process one at a time.
#pragma once

#include <map>
#include <string>

#include "backends/world_by_world.h"
#include "backends/worlds_on_cpus.h"

namespace hpccd {

class OneByOne final : public WorldByWorld {
 public:
  // `beside`: the CPU backend that works beside the device, with its memory of the worlds.
  OneByOne(Resources& shared, DetectionBackend& one, CpuBackend& beside, WorldMemories& memories)
      : WorldByWorld(shared), one_(one), beside_(beside), memories_(memories) {}

  void count(std::map<std::string, std::uint64_t>& stats) const override;
  void add_stages(std::map<std::string, double>& stages) const override;

 private:
  bool each_world(const Ask& ask) override;
  void add_counts();

  DetectionBackend& one_;
  CpuBackend& beside_;
  WorldMemories& memories_;
  std::map<std::string, std::uint64_t> counts_;  // of the device, for all worlds
  std::map<std::string, double> stages_;
};

}  // namespace hpccd
