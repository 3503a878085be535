// SPDX-License-Identifier: Apache-2.0
// Parents of nodes and of pairs of nodes, for traversals that go up again.
#pragma once

#include <vector>

#include "paper/hierarchy.h"

namespace hpccd::paper {

class Ancestry {
 public:
  Ancestry() = default;
  explicit Ancestry(const Hierarchy& h);  // split down to the leaves

  // The pair whose refinement (visit.h) gave p, which names two different nodes. Nodes give way together, so two nodes
  // of different depth mean that the upper one is a leaf that waited.
  Pair parent(Pair p) const {
    const auto a = depth_[p.a], b = depth_[p.b];
    return {a < b ? p.a : parent_[p.a], b < a ? p.b : parent_[p.b]};
  }
  std::size_t bytes() const { return parent_.capacity() * sizeof(NodeIndex) + depth_.capacity() * sizeof(depth_[0]); }

 private:
  std::vector<NodeIndex> parent_;
  std::vector<std::uint16_t> depth_;
};

}  // namespace hpccd::paper
