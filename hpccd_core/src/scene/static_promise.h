// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hpccd/hpccd.h"

namespace hpccd {

// Throws InvalidArgument, naming mesh and vertex, where a mesh added as static moves during the step: its pairs with
// other static meshes are never tested, so contacts would be lost silently. Positions must be in the host's memory.
void require_static_meshes_rest(const Scene& scene, Positions vertices_t0, Positions vertices_t1);

}  // namespace hpccd
