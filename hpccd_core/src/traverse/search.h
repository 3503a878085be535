// SPDX-License-Identifier: Apache-2.0
// What all threads share during one call, and what makes a query: which pairs of features it looks at, and how they are
// tested. Boxes, traversal, batches and order are the same for all.
#pragma once

#include <atomic>
#include <memory>

#include "base/cancellation.h"
#include "elementary/batch.h"
#include "elementary/fallback.h"
#include "elementary/intersection_batch.h"
#include "traverse/leaf_edge_faces.h"
#include "traverse/leaf_pairs.h"
#include "traverse/nearest_pairs.h"
#include "traverse/tasks.h"

namespace hpccd {

struct Search {
  Geometry geometry;
  // Which pairs of features of two leaves; null: none.
  LeafPairs leaf_pairs = nullptr;
  LeafPairsInSnapshot leaf_pairs_in_snapshot = nullptr;  // of one snapshot, within `reach` or what `nearest` leaves
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
  const Cancellation* cancellation = &never_cancelled;
};

}  // namespace hpccd
