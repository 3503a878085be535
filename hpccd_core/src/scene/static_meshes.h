// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "base/parallel.h"
#include "hpccd/hpccd.h"

namespace hpccd {

// Throws InvalidArgument with mesh and vertex if a static mesh moves during the step: its pairs with other static
// meshes are never tested, so contacts would be lost silently. Positions must be in host memory.
void require_static_meshes_rest(const Scene& scene, Positions vertices_t0, Positions vertices_t1);

// Stores the positions of the static meshes, so that data computed from them can be reused.
class StaticMeshes {
 public:
  // By mesh: whether a static mesh is bit-identical to the previous positions. Throws as above.
  std::vector<char> unchanged(const Scene& scene, Positions vertices_t0, Positions vertices_t1, ThreadPool& pool);
  std::size_t bytes() const;

 private:
  std::vector<std::vector<std::byte>> last_;  // of each static mesh
};

}  // namespace hpccd
