// SPDX-License-Identifier: Apache-2.0
// What all threads share during one call, and what makes a query: which pairs of features it looks at, and how they are
// tested. Boxes, traversal, batches and order are the same for all.
#pragma once

#include <atomic>
#include <limits>
#include <memory>

#include "base/cancellation.h"
#include "elementary/batch.h"
#include "elementary/fallback.h"
#include "elementary/intersection_batch.h"
#include "elementary/policy.h"
#include "traverse/drift.h"
#include "traverse/far_pairs.h"
#include "traverse/leaf_edge_faces.h"
#include "traverse/leaf_pairs.h"
#include "traverse/nearest_pairs.h"
#include "traverse/tasks.h"

namespace hpccd {

// How much of a motion matters.
struct PartOfMotion {
  float until;  // 1 or more: the whole
  float reach;  // up to then features stay within boxes at the start that are so far apart; below 0: too far
};

struct Search {
  Geometry geometry;
  BlockPairs block_pairs = nullptr;
  // For two meshes whose boxes have grown by more than their separation requires: by how much, and the pairs left.
  Excess excess;
  BlockPairsLessExcess block_pairs_less_excess = nullptr;
  LeafPairsLessExcess leaf_pairs_less_excess = nullptr;
  // Which pairs of features of two leaves; null: none.
  LeafPairs leaf_pairs = nullptr;
  // Of a part of the motion, where the earliest contacts are looked for; also by boxes at the start alone.
  LeafPairsUntil leaf_pairs_until = nullptr;
  LeafPairsInSnapshot leaf_pairs_at_start = nullptr;
  LeafPairsInSnapshot leaf_pairs_in_snapshot = nullptr;  // of one snapshot, within `reach` or what `nearest` leaves
  LeafPairsInSnapshot far_pairs = nullptr;               // in its place where nearest leaves are far apart
  LeafEdgeFaces leaf_edge_faces = nullptr;
  float reach = 0;
  // How they are tested, by number of the rule; edges against faces alike by all.
  BatchTest batch_test[n_rules];
  Fallback fallback[n_rules];
  IntersectionBatch intersection_batch = nullptr;
  // Where what is found goes; null: to the workers' lists.
  std::unique_ptr<NearestPairs> nearest;
  Report report;
  std::atomic<double> earliest;  // best time so far, where report is first
  bool time_only = false;        // the earliest time is all that is asked for, never a late one
  bool prunes = false;           // what cannot touch up to the best time is left out
  // Where pairs that are near in a snapshot are listed: how far the motion leaves it. Null: all pairs are looked at.
  const Drift* drift = nullptr;
  // In coordinates of the boxes: twice the longest way of a vertex along an axis, and how much of it boxes at the start
  // may grow by without reaching their neighbours' neighbours.
  float two_ways = std::numeric_limits<float>::infinity(), most_reach = 0;
  // Pairs that touch later do not matter; 1 or more: all do.
  float until() const {
    const double best = earliest.load(std::memory_order_relaxed);
    return prunes && best < 1 ? static_cast<float>(best + same_time) * (1 + 2e-7f) : 2;
  }
  PartOfMotion part() const {
    if (!prunes || !(earliest.load(std::memory_order_relaxed) < 1)) return {2, -1};
    const float time = until(), reach = time * two_ways * (1 + 1e-6f) + 1e-6f;
    return {time, reach <= most_reach ? reach : -1};
  }
  // Of a search that is worth its price only where it finds few: so many at most, and so many it found.
  std::size_t most_found = std::numeric_limits<std::size_t>::max();
  std::atomic<std::size_t> n_found = 0;
  bool bounded() const { return most_found < std::numeric_limits<std::size_t>::max(); }
  bool gave_up() const { return bounded() && n_found.load(std::memory_order_relaxed) > most_found; }
  // Nothing that is found could matter any more.
  bool over() const { return time_only && earliest.load(std::memory_order_relaxed) <= 0; }
  const Cancellation* cancellation = &never_cancelled;
};

}  // namespace hpccd
