// SPDX-License-Identifier: Apache-2.0
#include "paper/front.h"

#include <algorithm>
#include <utility>

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
namespace {

// 64 KiB: enough pairs that distributing segments costs nothing, few enough for an even distribution.
constexpr std::size_t longest_segment = 8192;

}  // namespace

std::vector<FrontSegment> FrontUpdate::operator()(const FrontSegment& segment) {
  kept_.clear();
  Pair last_climbed{no_node, no_node};
  for (const Pair p : segment) {
    worker_.heed_cancellation();
    ++worker_.node_pairs;
    if (overlaps(s_, p)) {
      descend(p);
      continue;
    }
    // All pairs below a pair that has separated climb to it, one after the other.
    const Pair top = climb(p);
    if (top == last_climbed) continue;
    last_climbed = top;
    if (top != p) ++counts_.ascended;
    keep(top);
  }
  return std::exchange(kept_, {});
}

void FrontUpdate::descend(Pair start) {
  stack_.push_back(start);
  while (!stack_.empty()) {
    worker_.heed_cancellation();
    const Pair p = stack_.back();
    stack_.pop_back();
    if (p != start) ++worker_.node_pairs;
    if (!enabled(s_, p)) continue;  // the rules do not change: such a pair never becomes enabled
    if (!overlaps(s_, p)) {
      keep(p);
    } else if (is_leaf_pair(s_, p)) {
      if (p.a == p.b) continue;  // there are no contacts within one triangle
      test_leaves(s_, p, worker_);
      keep(p);
    } else {
      ++counts_.descended;
      refine(s_.hierarchy, p, [](NodeIndex) {}, [&](Pair q) { stack_.push_back(q); });
    }
  }
}

Pair FrontUpdate::climb(Pair p) {
  for (;;) {
    const Pair up = ancestry_.parent(p);
    if (up.a == up.b || overlaps(s_, up)) return p;
    ++worker_.node_pairs;
    p = up;
  }
}

void FrontUpdate::keep(Pair p) {
  if (kept_.empty() || kept_.back().size() == longest_segment) kept_.emplace_back();
  kept_.back().push_back(p);
}

std::vector<FrontSegment> joined(std::vector<std::vector<FrontSegment>>&& pieces) {
  std::vector<FrontSegment> front;
  for (auto& piece : pieces)
    for (FrontSegment& segment : piece) {
      const bool repeated = !front.empty() && front.back().back() == segment.front();
      const std::size_t skip = repeated ? 1 : 0;
      if (segment.size() == skip) continue;
      if (!front.empty() && front.back().size() + segment.size() - skip <= longest_segment / 2) {
        front.back().insert(front.back().end(), segment.begin() + static_cast<std::ptrdiff_t>(skip), segment.end());
        continue;
      }
      if (repeated) segment.erase(segment.begin());
      front.push_back(std::move(segment));
    }
  return front;
}

}  // namespace hpccd::paper
