// SPDX-License-Identifier: Apache-2.0
// Divides the traversal into independent tasks: pairs of nodes (or one node with itself) are split until there are
// enough to keep every thread busy. The list depends on the tree only, never on the number of threads.
#pragma once

#include <vector>

#include "bvh/tree.h"
#include "scene/pair_rules.h"
#include "traverse/excess.h"

namespace hpccd {

struct NodePair {
  std::uint32_t a, b;  // a == b: pairs within the subtree
};

// Where a traversal ends.
struct AtLeaves {
  bool operator()(const Node& node) const { return !node.children; }
};
struct AtBlocks {
  bool operator()(const Node& node) const { return Tree::in_block(node); }
};

// Pushes the pairs that follow from a pair whose boxes overlap and at which the traversal does not end.
template <class Ends, class Push>
void refine(const std::vector<Node>& nodes, NodePair p, Ends ends, Push&& push) {
  const Node &a = nodes[p.a], &b = nodes[p.b];
  if (p.a == p.b) {
    push(NodePair{a.children, a.children});
    push(NodePair{a.children + 1, a.children + 1});
    push(NodePair{a.children, a.children + 1});
    return;
  }
  // The larger node is split; of equal ones both are.
  const bool split_a = !ends(a) && (ends(b) || a.primitives * 2 > b.primitives);
  const bool split_b = !ends(b) && (ends(a) || b.primitives * 2 > a.primitives);
  if (split_a && split_b) {
    for (std::uint32_t i = 0; i < 2; ++i)
      for (std::uint32_t j = 0; j < 2; ++j) push(NodePair{a.children + i, b.children + j});
  } else if (split_a) {
    for (std::uint32_t i = 0; i < 2; ++i) push(NodePair{a.children + i, p.b});
  } else {
    for (std::uint32_t j = 0; j < 2; ++j) push(NodePair{p.a, b.children + j});
  }
}

template <class Ends>
bool is_end(const std::vector<Node>& nodes, NodePair p, Ends ends) {
  return ends(nodes[p.a]) && ends(nodes[p.b]);
}

// Which boxes count: overlap(node, node) returns whether two nodes may contain a pair. For the whole motion:
struct MotionBoxes {
  using Ends = AtLeaves;
  static constexpr bool shrink = false;  // whether pairs on the stack may no longer be worth visiting
  bool overlap(const Node& a, const Node& b) const { return a.overlaps(b); }
  bool within(const Node&) const { return true; }  // the same for one node
};

// The same if boxes of some pairs of meshes have grown by more than their separation requires.
struct MotionBoxesLessExcess {
  using Ends = AtLeaves;
  static constexpr bool shrink = false;
  const Excess& excess;
  bool overlap(const Node& a, const Node& b) const { return a.overlaps(b, excess.of(a, b)); }
  bool within(const Node&) const { return true; }
};

// Whether features of two nodes, or of one, may have to be tested. Separate functions: the registers for the path
// through the rules would make every visit of the cases before it a third slower.
template <class Boxes>
[[gnu::always_inline]] inline bool boxes_meet(const Boxes& boxes, const Node& a, const Node& b) {
  return &a == &b ? boxes.within(a) : boxes.overlap(a, b);
}

template <class Boxes>
[[gnu::noinline]] bool worth_visiting_by_hash(const PairRules& rules, const Boxes& boxes, const Node& a,
                                              const Node& b) {
  return rules.enabled(a.mesh, b.mesh) && boxes_meet(boxes, a, b);
}

template <class Boxes>
[[gnu::noinline]] bool worth_visiting_by_rules(const PairRules& rules, const Boxes& boxes, const Node& a,
                                               const Node& b) {
  if (!rules.by_table()) return worth_visiting_by_hash(rules, boxes, a, b);
  return rules.enabled_by_table(a.mesh, b.mesh) && boxes_meet(boxes, a, b);
}

template <class Boxes>
bool worth_visiting(const std::vector<Node>& nodes, const PairRules& rules, const Boxes& boxes, NodePair p) {
  const Node &a = nodes[p.a], &b = nodes[p.b];
  if (a.only_points && b.only_points) return false;
  return rules.all_meshes() ? boxes_meet(boxes, a, b) : worth_visiting_by_rules(rules, boxes, a, b);
}

// Divides the traversal into pairs that are all worth visiting.
template <class Boxes>
std::vector<NodePair> traversal_tasks(const Tree& tree, const PairRules& rules, const Boxes& boxes,
                                      std::size_t enough) {
  std::vector<NodePair> level, next;
  // The root may be the whole tree: a mesh of one leaf, for which self-collision may be disabled.
  constexpr NodePair root{0, 0};
  constexpr typename Boxes::Ends ends;
  if (tree.nodes.empty() || !worth_visiting(tree.nodes, rules, boxes, root)) return level;
  level.push_back(root);
  for (bool progress = true; progress && level.size() < enough;) {
    progress = false;
    next.clear();
    for (const NodePair& p : level) {
      if (is_end(tree.nodes, p, ends)) {
        next.push_back(p);
        continue;
      }
      refine(tree.nodes, p, ends, [&](NodePair q) {
        if (worth_visiting(tree.nodes, rules, boxes, q)) next.push_back(q);
      });
      progress = true;
    }
    level.swap(next);
  }
  return level;
}

}  // namespace hpccd
