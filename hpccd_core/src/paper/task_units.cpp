// SPDX-License-Identifier: Apache-2.0
#include "paper/task_units.h"

namespace hpccd::paper {

void TaskUnits::perform_self_cd(NodeIndex assigned) {
  if (assigned != no_node) add_unit(assigned);
  do {
    perform_units();
    ++counts_.requests;
  } while (scheduling_.request(thread_, units_));
}

void TaskUnits::perform_units() {
  while (!units_.empty()) {
    const NodeIndex n = units_.front();
    units_.pop_front();
    set_up(n);
    traverse_pairs();
    if (scheduling_.requested(thread_)) counts_.nodes_given += scheduling_.distribute(thread_, units_);
  }
}

// A unit is needed if the mesh may collide with itself and has at least two triangles.
void TaskUnits::add_unit(NodeIndex n) {
  if (!s_.hierarchy.nodes[n].is_leaf() && enabled(s_, {n, n})) units_.push_back(n);
}

void TaskUnits::set_up(NodeIndex n) {
  ++counts_.units;
  upkeep_.examine(n, counts_.upkeep);
  const NodeIndex l = Hierarchy::left(n), r = s_.hierarchy.right(n);
  add_unit(l);
  add_unit(r);
  pairs_.push_back({l, r});
  scheduling_.show_front(thread_, units_.empty() ? 0 : s_.hierarchy.nodes[units_.front()].count);
}

void TaskUnits::traverse_pairs() {
  while (!pairs_.empty()) {
    const Pair p = pairs_.back();
    pairs_.pop_back();
    visit(
        s_, p, worker_, [&](NodeIndex n) { upkeep_.examine(n, counts_.upkeep); }, [&](Pair q) { pairs_.push_back(q); });
  }
}

}  // namespace hpccd::paper
