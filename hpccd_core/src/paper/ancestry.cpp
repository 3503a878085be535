// SPDX-License-Identifier: Apache-2.0
#include "paper/ancestry.h"

namespace hpccd::paper {

Ancestry::Ancestry(const Hierarchy& h) : parent_(h.nodes.size()), depth_(h.nodes.size()) {
  // Depth-first order: parents come before their children.
  for (NodeIndex n = 0; n < h.nodes.size(); ++n) {
    if (!h.nodes[n].is_split) continue;
    for (NodeIndex child : {Hierarchy::left(n), h.right(n)}) {
      parent_[child] = n;
      depth_[child] = static_cast<std::uint16_t>(depth_[n] + 1);
    }
  }
}

}  // namespace hpccd::paper
