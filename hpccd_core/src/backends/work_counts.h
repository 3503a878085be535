// SPDX-License-Identifier: Apache-2.0
// Counts of the work of one query, per worker or in total. Plain numbers, since they are added up over worlds.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "traverse/worker.h"

namespace hpccd {

struct WorkCounts {
  std::uint64_t node_pairs = 0, leaf_pairs = 0, near_pairs = 0;
  BatchCounts batches[3];  // by kind
  FallbackCounts fallbacks[3];
  std::uint64_t ignored[3] = {};
  double leaf_pairs_seconds = 0, kdop_seconds = 0;
  // Kinds of pairs that the query tested; whether it searched the earliest contacts; whether it was timed by stage.
  bool asked[3] = {}, earliest = false, timed = false;

  void add(const std::vector<Worker>& workers);
  WorkCounts& operator+=(const WorkCounts& other);
  void write(std::map<std::string, std::uint64_t>& stats) const;
};

}  // namespace hpccd
