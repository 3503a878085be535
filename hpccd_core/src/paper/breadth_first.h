// SPDX-License-Identifier: Apache-2.0
// A front of nodes without parent-child relations, found by traversing the hierarchy from its root in breadth-first
// order until there are enough nodes (Kim et al. 2009, section 4.2 and Fig. 4).
#pragma once

#include <deque>
#include <vector>

#include "paper/hierarchy.h"

namespace hpccd::paper {

struct BreadthFirstFront {
  std::vector<NodeIndex> low;                // the front: roots of the low-level nodes
  std::vector<std::vector<NodeIndex>> high;  // the nodes above it, by depth
};

// may_split(node): whether its children may be used.
template <class MaySplit>
BreadthFirstFront breadth_first_front(const Hierarchy& h, std::size_t enough, MaySplit&& may_split) {
  struct Entry {
    NodeIndex node;
    std::size_t depth;
  };
  BreadthFirstFront front;
  if (h.nodes.empty()) return front;
  std::deque<Entry> queue{{0, 0}};
  while (!queue.empty() && queue.size() + front.low.size() < enough) {
    const Entry e = queue.front();
    queue.pop_front();
    if (!may_split(e.node)) {
      front.low.push_back(e.node);
      continue;
    }
    if (e.depth == front.high.size()) front.high.emplace_back();
    front.high[e.depth].push_back(e.node);
    queue.push_back({Hierarchy::left(e.node), e.depth + 1});
    queue.push_back({h.right(e.node), e.depth + 1});
  }
  for (const Entry& e : queue) front.low.push_back(e.node);
  return front;
}

}  // namespace hpccd::paper
