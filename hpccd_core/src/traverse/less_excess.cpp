// SPDX-License-Identifier: Apache-2.0
// The traversal for scenes in which the boxes of some pairs of meshes have grown more than their separation requires
// (excess.h).
#include <algorithm>

#include "traverse/boxes_until.h"
#include "traverse/pair_pool.h"
#include "traverse/worker.h"

namespace hpccd {
namespace {

#include "traverse/walk.inl"

}  // namespace

void ContactSearch::traverse_less_excess(ThreadPool& pool, std::vector<Worker>& workers) {
  if (report == Report::any)
    traverse_any(MotionBoxesLessExcess{excess}, *this, pool, workers);
  else if (prunes)
    traverse_all(BoxesUntilLessExcess{{*this}}, *this, pool, workers);
  else
    traverse_all(MotionBoxesOfBlocksLessExcess{{excess}}, *this, pool, workers);
}

}  // namespace hpccd
