// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "scene/features.h"
#include "scene/vertex_motion.h"

namespace hpccd {

// The length of a short edge of the scene (EdgeSample::short_one): its largest extent along an axis, at the end of the
// motion where that is less. 0 where there are no edges.
double short_edge(const Features& features, const std::vector<VertexMotion>& vertices);

}  // namespace hpccd
