// SPDX-License-Identifier: Apache-2.0
// What all threads share during one call, and what makes a query: which pairs of features it looks at, and how they are
// tested. Boxes, traversal, batches and order are the same for all.
#pragma once

#include <atomic>

#include "base/cancellation.h"
#include "elementary/batch.h"
#include "elementary/fallback.h"
#include "traverse/leaf_pairs.h"
#include "traverse/tasks.h"

namespace hpccd {

struct Search {
  Geometry geometry;
  LeafPairs leaf_pairs;
  BatchTest batch_test[n_rules];  // by number of the rule
  Fallback fallback[n_rules];
  Report report;
  std::atomic<double> earliest;  // best time so far, where report is first
  const Cancellation* cancellation = &never_cancelled;
};

}  // namespace hpccd
