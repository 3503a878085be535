// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/parallel.h"
#include "paper/hierarchy.h"

namespace hpccd::paper {

// The hierarchy of the first step, split down to single triangles: on one thread until there are enough subtrees, then
// each thread takes subtrees. (Later steps refit, and split again according to section 6: upkeep.h.)
void build(Hierarchy& h, const Features& features, const std::vector<Box>& vertex_boxes, ThreadPool& pool);

}  // namespace hpccd::paper
