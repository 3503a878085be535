// SPDX-License-Identifier: Apache-2.0
// Computes a step on CPU threads and this machine's GPUs together (Kim et al. 2009, section 5): bounds, hierarchy and
// traversal are those of the CPU backend; pairs of leaves are tested on the devices.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "backends/cpu_backend.h"
#include "hybrid/engine.h"

namespace hpccd {

class HybridBackend final : public DetectionBackend {
 public:
  HybridBackend(Resources& shared, CpuBackend& cpu) : shared_(shared), cpu_(cpu) {}

  std::optional<Detection> detect(Positions t0, Positions t1) override;
  void count(std::map<std::string, std::uint64_t>& stats) const override;

 private:
  bool start();
  hybrid::LeafTable leaves();
  void list_primitives();

  Resources& shared_;
  CpuBackend& cpu_;
  std::unique_ptr<hybrid::Engine> engine_;
  // For the published methods: each primitive is a leaf.
  std::vector<LeafRange> primitives_;
  std::vector<std::uint32_t> face_of_primitive_;
};

}  // namespace hpccd
