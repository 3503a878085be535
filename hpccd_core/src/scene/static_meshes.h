// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "base/parallel.h"
#include "hpccd/hpccd.h"

namespace hpccd {

// Throws InvalidArgument, naming mesh and vertex, where a mesh added as static moves during the step: its pairs with
// other static meshes are never tested, so contacts would be lost silently. Positions must be in the host's memory.
void require_static_meshes_rest(const Scene& scene, Positions vertices_t0, Positions vertices_t1);

// Remembers where the static meshes were, so that what was computed from their positions can be kept.
class StaticMeshes {
 public:
  // By mesh: true where a static mesh is bit for bit where it was at the last look. Throws as above.
  std::vector<char> unchanged(const Scene& scene, Positions vertices_t0, Positions vertices_t1, ThreadPool& pool);
  std::size_t bytes() const;

 private:
  std::vector<std::vector<std::byte>> last_;  // of each static mesh
};

}  // namespace hpccd
