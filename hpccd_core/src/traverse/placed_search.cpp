// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "traverse/pair_pool.h"
#include "traverse/snapshot_boxes.h"
#include "traverse/worker.h"

namespace hpccd {
namespace {

#include "traverse/walk.inl"

struct PlacedBoxes {
  using Ends = AtLeaves;
  static constexpr bool shrink = false;
  float reach;
  AtPoses at;
  bool overlap(const Node& a, const Node& b) const { return at(a).near_in_snapshot(at(b), reach); }
  bool within(const Node&) const { return true; }
};

}  // namespace

void traverse_placed(SnapshotSearch& search, ThreadPool& pool, std::vector<Worker>& workers) {
  traverse_all(PlacedBoxes{search.reach, {*search.placed}}, search, pool, workers);
}

void traverse_placed(DistanceSearch& search, ThreadPool& pool, std::vector<Worker>& workers) {
  traverse_all(NearerBoxes<AtPoses>(search.tree, search.nearest, {*search.placed}), search, pool, workers);
}

}  // namespace hpccd
