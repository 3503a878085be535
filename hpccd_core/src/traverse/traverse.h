// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "traverse/tasks.h"
#include "traverse/worker.h"

namespace hpccd {

// The elementary tests of two leaves, at the accuracy of their meshes.
void test_leaves(const Tree& tree, const PairRules& rules, LeafPair pair, Worker& worker);

// Default traversal: depth first, by threads that share what they have left (pair_pool.h); where any one contact will
// do, by independent tasks in their order, so that the answer does not depend on the threads. Leaves what was found in
// the workers, one per thread of the pool.
void traverse(const Tree& tree, const PairRules& rules, Search& search, ThreadPool& pool, std::vector<Worker>& workers);
// Of a motion where search.excess.any(): less_excess.cpp.
void traverse_less_excess(const Tree& tree, const PairRules& rules, Search& search, ThreadPool& pool,
                          std::vector<Worker>& workers);

}  // namespace hpccd
