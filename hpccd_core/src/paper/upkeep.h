// SPDX-License-Identifier: Apache-2.0
// Lazy selective restructuring (Kim et al. 2009, sections 3.1, 3.3 and 6): a node that culls worse than after its last
// split is split again when a traversal first needs its children in a step; its descendants likewise, if and when they
// are needed. Nodes that no traversal reaches are not restructured.
//
// A node is examined before any of its children is named in a pair, and at most once per step. Therefore no pair ever
// names a node that a later restructuring of an ancestor moves, in whatever order the pairs are processed.
#pragma once

#include <array>
#include <map>
#include <mutex>
#include <string>

#include "base/parallel.h"
#include "base/profiler.h"
#include "paper/hierarchy.h"

namespace hpccd::paper {

struct UpkeepCounts {
  std::uint64_t restructured = 0;  // nodes that were split again because they culled badly
  std::uint64_t split_lazily = 0;  // nodes below those, split when needed
  std::uint64_t lock_waits = 0;    // times that a thread found a lock taken
};

// The hierarchy of the published and of the naive method.
class Upkeep {
 public:
  Upkeep(const Features& features, bool restructure) : features_(features), restructure_(restructure) {}

  const Hierarchy& hierarchy() const { return h_; }

  // Updates the hierarchy to this step; profiled as "build" or "refit".
  void begin_step(const std::vector<Box>& vertex_boxes, ThreadPool& pool, Profiler& profiler);
  // The step is complete. Otherwise (an exception) the next one rebuilds the hierarchy.
  void end_step() { whole_ = true; }

  // Makes sure that a node with several primitives has children. The first function is for a thread that has the
  // subtree to itself (the disjoint property of section 4.1); the second for threads that may visit the same node
  // (sections 3.2 and 4.4).
  void examine(NodeIndex n, UpkeepCounts& counts);
  void examine_locked(NodeIndex n, UpkeepCounts& counts);

 private:
  bool worn(NodeIndex n) const;
  void make_children(NodeIndex n, UpkeepCounts& counts);

  const Features& features_;
  const bool restructure_;
  Hierarchy h_;
  std::uint32_t step_ = 0;
  bool whole_ = false;
  std::array<std::mutex, 256> locks_;  // many nodes share one
};

void add_counts(std::map<std::string, std::uint64_t>& stats, const UpkeepCounts& counts);

}  // namespace hpccd::paper
