// SPDX-License-Identifier: Apache-2.0
// The traversal where boxes of some pairs of meshes have grown by more than they ask for (excess.h).
#include <algorithm>

#include "traverse/boxes_until.h"
#include "traverse/pair_pool.h"
#include "traverse/traverse.h"

namespace hpccd {
namespace {

#include "traverse/walk.inl"

}  // namespace

void traverse_less_excess(const Tree& tree, const PairRules& rules, Search& search, ThreadPool& pool,
                          std::vector<Worker>& workers) {
  if (search.report == Report::any)
    traverse_any(tree, rules, MotionBoxesLessExcess{search.excess}, search, pool, workers);
  else if (search.prunes)
    traverse_all(tree, rules, BoxesUntilLessExcess{{search}}, search, pool, workers);
  else
    traverse_all(tree, rules, MotionBoxesOfBlocksLessExcess{{search.excess}}, search, pool, workers);
}

}  // namespace hpccd
