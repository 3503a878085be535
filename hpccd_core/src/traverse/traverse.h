// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "traverse/tasks.h"
#include "traverse/worker.h"

namespace hpccd {

// The elementary tests of two leaves, at the accuracy of their meshes.
void test_leaves(const Tree& tree, const PairRules& rules, LeafPair pair, Worker& worker);

// Default traversal: independent tasks handed out in order by one atomic counter; each is walked depth first.
// Leaves what was found in the workers, one per thread of the pool.
void traverse(const Tree& tree, const PairRules& rules, Search& search, ThreadPool& pool, std::vector<Worker>& workers);

}  // namespace hpccd
