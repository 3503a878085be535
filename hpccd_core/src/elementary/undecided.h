// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "elementary/batch.h"
#include "elementary/fallback.h"
#include "elementary/pair.h"

namespace hpccd {

// The data that the fallback needs for a pair that a batch left undecided.
inline UndecidedPair undecided_pair(const Geometry& g, const Candidate& pair) {
  std::uint32_t v[4];
  pair_vertices(g, pair.kind, pair.first, pair.second, v);
  UndecidedPair q{pair.kind, {}, {}, g.separations.look_up(pair.kind, pair.first, pair.second, v)};
  pair_positions(g, pair.kind, pair.first, pair.second, q.t0, q.t1);
  return q;
}

}  // namespace hpccd
