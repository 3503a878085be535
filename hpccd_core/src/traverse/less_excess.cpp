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

struct MotionBoxesOfBlocks : MotionBoxesLessExcess {
  using Ends = AtBlocks;
  const ContactSearch& search;
  std::uint32_t leaf_pairs(const Block& a, const Block& b, LeafPair* found) const {
    const float by = excess.of(search.tree.nodes[a.node], search.tree.nodes[b.node]);
    return by > 0 ? search.block_pairs_less_excess(search.tree, a, b, by, found)
                  : search.block_pairs(search.tree, a, b, found);
  }
};

}  // namespace

void ContactSearch::traverse_less_excess(ThreadPool& pool, std::vector<Worker>& workers) {
  if (report == Report::any)
    traverse_any(MotionBoxesLessExcess{excess}, *this, pool, workers);
  else if (prunes)
    traverse_all(BoxesUntilLessExcess{{*this}}, *this, pool, workers);
  else
    traverse_all(MotionBoxesOfBlocks{{excess}, *this}, *this, pool, workers);
}

}  // namespace hpccd
