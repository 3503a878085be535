// SPDX-License-Identifier: Apache-2.0
// Overlap of boxes when only the earliest contacts are searched: only boxes that may overlap before the best time so
// far count. That time decreases during the search.
#pragma once

#include <utility>

#include "traverse/search.h"

namespace hpccd {

struct BoxesUntil {
  using Ends = AtLeaves;
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
};

}  // namespace hpccd
