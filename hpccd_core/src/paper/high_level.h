// SPDX-License-Identifier: Apache-2.0
// Inter-CD task units of high-level nodes, each processed by all threads (Kim et al. 2009, section 4.4).
#pragma once

#include "paper/task_units.h"

namespace hpccd::paper {

// The units of nodes without parent-child relationship. Their pair queue is dealt out to the threads in turn, so that
// neighbours in the queue, which cost alike, go to different threads. Threads may meet at a node: reconstruction locks.
void perform_high_level(const Scenery& scenery, Upkeep& upkeep, const std::vector<NodeIndex>& nodes, ThreadPool& pool,
                        std::vector<Worker>& workers, std::vector<TaskCounts>& counts);

}  // namespace hpccd::paper
