// SPDX-License-Identifier: Apache-2.0
// Which boxes count where the earliest contacts are looked for: those that may overlap no later than the best time so
// far, which falls while the search goes on.
#pragma once

#include <utility>

#include "traverse/search.h"

namespace hpccd {

struct BoxesUntil {
  static constexpr bool shrink = true;
  const Search& search;
  float until = search.until();  // when it was looked at last

  bool changed() {
    const float now = search.until();
    return std::exchange(until, now) != now;
  }
  bool overlap(const Node& a, const Node& b) const { return until < 1 ? a.overlap_until(b, until) : a.overlaps(b); }
  bool open(NodePair) const { return !search.over(); }
  void sort(std::vector<NodePair>&, std::size_t) const {}
};

}  // namespace hpccd
