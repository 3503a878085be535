// SPDX-License-Identifier: Apache-2.0
// The front of the traversal tree (Tang et al. 2009): the pairs of nodes at which the last traversal ended, because
// the boxes do not overlap or both nodes are leaves. The next traversal starts there: it descends where boxes now
// overlap, and ascends where pairs have separated.
#pragma once

#include <vector>

#include "paper/hierarchy.h"
#include "paper/visit.h"

namespace hpccd::paper {

// Parents of nodes and of pairs of nodes, for traversals that ascend.
class Ancestry {
 public:
  Ancestry() = default;
  explicit Ancestry(const Hierarchy& h);  // split down to the leaves

  // The pair whose refinement (visit.h) produced p, which refers to two different nodes. Both nodes are split together,
  // so if their depths differ, the upper one is a leaf that waited.
  Pair parent(Pair p) const {
    const auto a = depth_[p.a], b = depth_[p.b];
    return {a < b ? p.a : parent_[p.a], b < a ? p.b : parent_[p.b]};
  }
  std::size_t bytes() const { return parent_.capacity() * sizeof(NodeIndex) + depth_.capacity() * sizeof(depth_[0]); }

 private:
  std::vector<NodeIndex> parent_;
  std::vector<std::uint16_t> depth_;
};

// A part of the front, in the depth-first order of the traversal tree: pairs below one pair are contiguous.
using FrontSegment = std::vector<Pair>;

struct FrontCounts {
  std::uint64_t descended = 0, ascended = 0;  // pairs that were refined, and pairs that replaced pairs below them
};

// The front after this step's bounds, for one segment; overlapping pairs that cannot be refined are tested.
class FrontUpdate {
 public:
  FrontUpdate(const Scenery& scenery, const Ancestry& ancestry, Worker& worker, FrontCounts& counts)
      : s_(scenery), ancestry_(ancestry), worker_(worker), counts_(counts) {}

  std::vector<FrontSegment> operator()(const FrontSegment& segment);

 private:
  void descend(Pair p);
  Pair climb(Pair p);
  void keep(Pair p);

  const Scenery& s_;
  const Ancestry& ancestry_;
  Worker& worker_;
  FrontCounts& counts_;
  std::vector<Pair> stack_;
  std::vector<FrontSegment> kept_;
};

// Joins the segments of a front in order. If two threads replaced the halves of one run by the same pair, it is kept
// once.
std::vector<FrontSegment> joined(std::vector<std::vector<FrontSegment>>&& pieces);

}  // namespace hpccd::paper
