// SPDX-License-Identifier: Apache-2.0
// The nearest features of meshes at poses on one device (bvh/placed_meshes.h). Their tree and shapes are copied to the
// device once; a call copies poses.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "bvh/placed_meshes.h"
#include "gpu/nearest.h"
#include "gpu/pipeline.h"

namespace hpccd::gpu {

class PlacedSearch {
 public:
  // The arguments must outlive the object, and the meshes are placed. Throws Error as Pipeline::create does.
  static std::unique_ptr<PlacedSearch> create(const Scene& scene, const Features& features, const Options& options,
                                              const SeparationTable& separations, const ThicknessTable& thickness,
                                              const FeatureFilter& filter, const PlacedMeshes& placed, int device);
  virtual ~PlacedSearch() = default;

  // The nearest features of each of these pairs of meshes, where they are placed now. `version` changes with the pairs.
  virtual NearestPairsFound find_nearest(const std::vector<PairToSearch>& pairs, std::uint64_t version) = 0;

  virtual std::map<std::string, std::uint64_t> stats() const = 0;
  virtual std::map<std::string, double> stages() const = 0;  // device ms by stage, if requested
};

}  // namespace hpccd::gpu
