// SPDX-License-Identifier: Apache-2.0
// Parallel BVH update (Kim et al. 2009, section 6).
#pragma once

#include "base/parallel.h"
#include "paper/hierarchy.h"

namespace hpccd::paper {

// New bounds for the same hierarchy, bottom up: the subtrees of a front of 2k nodes for k threads, each thread taking
// the next when it has finished one; then, on one thread, the nodes above.
void refit(Hierarchy& h, const Features& features, const std::vector<Box>& vertex_boxes, ThreadPool& pool);

// Only the boxes of all primitives.
void bound_primitives(Hierarchy& h, const Features& features, const std::vector<Box>& vertex_boxes, ThreadPool& pool);

}  // namespace hpccd::paper
