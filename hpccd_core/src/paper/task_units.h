// SPDX-License-Identifier: Apache-2.0
// Inter-CD task units (Kim et al. 2009, section 4.1 and Listing 1). A unit of node n finds the collisions between the
// two children of n; it reads and restructures only nodes below n. No two nodes in the threads' task unit queues are
// parent and child, so threads work on disjoint sets of nodes and need no lock.
#pragma once

#include <vector>

#include "paper/scheduling.h"
#include "paper/upkeep.h"
#include "paper/visit.h"

namespace hpccd::paper {

struct TaskCounts {
  UpkeepCounts upkeep;
  std::uint64_t units = 0, nodes_given = 0, requests = 0;
};

// The work of one thread on its task unit queue and its collision test pair queue.
class TaskUnits {
 public:
  TaskUnits(const Scenery& scenery, Upkeep& upkeep, Scheduling& scheduling, int thread, Worker& worker,
            TaskCounts& counts)
      : s_(scenery), upkeep_(upkeep), scheduling_(scheduling), thread_(thread), worker_(worker), counts_(counts) {}

  // Listing 1 from an initially assigned node (section 4.2; or no_node), and from every node that other threads give.
  void perform_self_cd(NodeIndex assigned);

 private:
  void add_unit(NodeIndex n);
  void perform_units();
  void set_up(NodeIndex n);
  void traverse_pairs();

  const Scenery& s_;
  Upkeep& upkeep_;
  Scheduling& scheduling_;
  const int thread_;
  Worker& worker_;
  TaskCounts& counts_;
  TaskUnitQueue units_;
  // Pairs are taken from the end. In queue order, the breadth of the traversal would have to be stored: millions of
  // pairs.
  std::vector<Pair> pairs_;
};

}  // namespace hpccd::paper
