// SPDX-License-Identifier: Apache-2.0
// Inter-CD task units of high-level nodes, each processed by all threads (Kim et al. 2009, section 4.4).
#pragma once

#include "paper/task_units.h"

namespace hpccd::paper {

// The units of nodes without parent-child relations. Their pair queue is distributed to the threads round-robin, so
// that neighbours in the queue, which have similar costs, go to different threads. Several threads may visit the same
// node: reconstruction takes a lock.
void perform_high_level(const Scenery& scenery, Upkeep& upkeep, const std::vector<NodeIndex>& nodes, ThreadPool& pool,
                        std::vector<Worker>& workers, std::vector<TaskCounts>& counts);

}  // namespace hpccd::paper
