// SPDX-License-Identifier: Apache-2.0
#include "paper/refit.h"

#include "bvh/primitive_box.h"
#include "paper/breadth_first.h"

namespace hpccd::paper {
namespace {

class Refit {
 public:
  Refit(Hierarchy& h, const Features& features, const std::vector<Box>& vertex_boxes, const Cancellation& cancellation)
      : h_(h), features_(features), vertex_boxes_(vertex_boxes), cancellation_(cancellation) {}

  void subtree(NodeIndex n) {
    if (!h_.nodes[n].is_split) return primitives(h_.nodes[n]);
    if (h_.nodes[n].count > many) cancellation_.heed();
    subtree(Hierarchy::left(n));
    subtree(h_.right(n));
    from_children(n);
  }

  void from_children(NodeIndex n) {
    h_.nodes[n].box = h_.nodes[Hierarchy::left(n)].box;
    h_.nodes[n].box.include(h_.nodes[h_.right(n)].box);
  }

 private:
  static constexpr std::uint32_t many = 1024;  // 10 us

  // A leaf, or a node whose children nothing has needed: the nodes below it are invalid.
  void primitives(Node& node) {
    node.box = {};
    for (std::uint32_t i = node.begin; i < node.begin + node.count; ++i) {
      const std::uint32_t c = h_.order[i];
      h_.primitive_boxes[c] = primitive_box(features_, vertex_boxes_, c);
      node.box.include(h_.primitive_boxes[c]);
    }
  }

  Hierarchy& h_;
  const Features& features_;
  const std::vector<Box>& vertex_boxes_;
  const Cancellation& cancellation_;
};

}  // namespace

void refit(Hierarchy& h, const Features& features, const std::vector<Box>& vertex_boxes, ThreadPool& pool) {
  const auto k = static_cast<std::size_t>(pool.size());
  const BreadthFirstFront front = breadth_first_front(h, 2 * k, [&](NodeIndex n) { return h.nodes[n].is_split; });
  Refit refit(h, features, vertex_boxes, pool.cancellation());
  parallel_for(pool, front.low.size(), 1, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t i = begin; i < end; ++i) refit.subtree(front.low[i]);
  });
  for (auto level = front.high.rbegin(); level != front.high.rend(); ++level)
    for (NodeIndex n : *level) refit.from_children(n);
}

void bound_primitives(Hierarchy& h, const Features& features, const std::vector<Box>& vertex_boxes, ThreadPool& pool) {
  resize(h.primitive_boxes, features.n_primitives(), pool.cancellation());
  parallel_for(pool, features.n_primitives(), 4096, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t c = begin; c < end; ++c)
      h.primitive_boxes[c] = primitive_box(features, vertex_boxes, static_cast<std::uint32_t>(c));
  });
}

}  // namespace hpccd::paper
