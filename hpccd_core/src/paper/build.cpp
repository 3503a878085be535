// SPDX-License-Identifier: Apache-2.0
#include "paper/build.h"

#include "paper/breadth_first.h"
#include "paper/refit.h"

namespace hpccd::paper {
namespace {

void split_subtree(Hierarchy& h, NodeIndex n, const Features& features) {
  if (h.nodes[n].is_leaf()) return;
  h.split(n, features);
  split_subtree(h, Hierarchy::left(n), features);
  split_subtree(h, h.right(n), features);
}

}  // namespace

void build(Hierarchy& h, const Features& features, const std::vector<Box>& vertex_boxes, ThreadPool& pool) {
  h.heed(pool.cancellation());
  bound_primitives(h, features, vertex_boxes, pool);
  h.start(features);
  const auto enough = 8 * static_cast<std::size_t>(pool.size());
  const BreadthFirstFront front = breadth_first_front(h, enough, [&](NodeIndex n) {
    if (h.nodes[n].is_leaf()) return false;
    h.split(n, features);
    return true;
  });
  parallel_for(pool, front.low.size(), 1, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t i = begin; i < end; ++i) split_subtree(h, front.low[i], features);
  });
}

}  // namespace hpccd::paper
