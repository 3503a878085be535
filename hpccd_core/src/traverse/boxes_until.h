// SPDX-License-Identifier: Apache-2.0
// Overlap of boxes when only the earliest contacts are searched: only boxes that may overlap before the best time so
// far count. That time decreases during the search.
#pragma once

#include <utility>

#include "traverse/search.h"

namespace hpccd {

struct BoxesUntil {
  using Ends = AtBlocks;
  static constexpr bool shrink = true;
  const ContactSearch& search;
  // The best time when it was last read.
  double best = search.earliest.load(std::memory_order_relaxed);
  PartOfMotion part = search.part();

  bool changed() {
    const double now = search.earliest.load(std::memory_order_relaxed);
    if (std::exchange(best, now) == now) return false;
    part = search.part();
    return true;
  }
  bool overlap(const Node& a, const Node& b) const {
    if (part.until >= 1) return a.overlaps(b);
    return part.reach >= 0 ? a.near_at_start(b, part.reach) : a.overlap_until(b, part.until);
  }
  bool within(const Node&) const { return true; }
  std::uint32_t leaf_pairs(const Block& a, const Block& b, LeafPair* found) const {
    if (part.until >= 1) return search.block_pairs(search.tree, a, b, found);
    return search.block_pairs_until(search.tree, a, b, part.until, part.reach, search.geometry.margin, found);
  }
  bool open(NodePair) const { return !search.over(); }
  void sort(std::vector<NodePair>&, std::size_t) const {}
};

// The same for scenes with an excess: boxes of some pairs of meshes have grown by more than their separation requires.
struct BoxesUntilLessExcess : BoxesUntil {
  bool overlap(const Node& a, const Node& b) const {
    const float excess = search.excess.of(a, b);
    if (part.until < 1 && part.reach >= 0) return a.near_at_start(b, part.reach - excess);
    return a.overlaps(b, excess) && (part.until >= 1 || a.overlap_until(b, part.until));
  }
  // Up to a time below 1 the few leaves that only the excess keeps near are left to the tests of their features.
  std::uint32_t leaf_pairs(const Block& a, const Block& b, LeafPair* found) const {
    const float excess = search.excess.of(search.tree.nodes[a.node], search.tree.nodes[b.node]);
    if (excess > 0 && part.until >= 1) return search.block_pairs_less_excess(search.tree, a, b, excess, found);
    return BoxesUntil::leaf_pairs(a, b, found);
  }
};

}  // namespace hpccd
