// SPDX-License-Identifier: Apache-2.0
// One iteration of the main collision detection loop (Kim et al. 2009, sections 3.2 and 4.1, Listing 1): the overlap
// test of a pair, then its refinement or the elementary tests.
#pragma once

#include "paper/hierarchy.h"
#include "paper/primitive_pairs.h"
#include "scene/pair_rules.h"
#include "traverse/worker.h"

namespace hpccd::paper {

// The data that a traversal reads.
struct Scenery {
  const Hierarchy& hierarchy;
  const Features& features;
  const PairRules& rules;
  const std::vector<Box>& vertex_boxes;
};

inline bool overlaps(const Scenery& s, Pair p) {
  const Node &a = s.hierarchy.nodes[p.a], &b = s.hierarchy.nodes[p.b];
  return p.a == p.b || a.box.overlaps(b.box);
}

inline bool enabled(const Scenery& s, Pair p) {
  return s.rules.enabled(s.hierarchy.nodes[p.a].mesh, s.hierarchy.nodes[p.b].mesh);
}

inline bool is_leaf_pair(const Scenery& s, Pair p) {
  return s.hierarchy.nodes[p.a].is_leaf() && s.hierarchy.nodes[p.b].is_leaf();
}

// The elementary tests of two leaves whose boxes overlap.
inline void test_leaves(const Scenery& s, Pair p, Worker& worker) {
  if (p.a == p.b) return;  // within one triangle, all features share vertices
  const Node &a = s.hierarchy.nodes[p.a], &b = s.hierarchy.nodes[p.b];
  const std::uint32_t primitive_a = s.hierarchy.order[a.begin], primitive_b = s.hierarchy.order[b.begin];
  ++worker.leaf_pairs;
  if (!worker.sink)
    // Nodes store their meshes: those of the primitives would be read from a table in random order.
    test_primitives(s.features, s.rules.rule(a.mesh, b.mesh), s.vertex_boxes, {primitive_a, a.box},
                    {primitive_b, b.box}, worker);
  else
    for (const LeafPair left : worker.sink->push({primitive_a, primitive_b}))
      test_primitives(s.features, s.rules, s.vertex_boxes, left, worker);
}

// Both nodes are split together; a leaf waits for the other. `examine(node)` is called before a node's children are
// named: Listing 1 reconstructs before the overlap test, which needs the node's own box only, so here pairs that do not
// overlap cause no reconstruction.
template <class Examine, class Push>
void refine(const Hierarchy& h, Pair p, Examine&& examine, Push&& push) {
  const bool split_a = !h.nodes[p.a].is_leaf(), split_b = !h.nodes[p.b].is_leaf();
  if (split_a) examine(p.a);
  if (p.a == p.b) {
    const NodeIndex l = Hierarchy::left(p.a), r = h.right(p.a);
    push(Pair{l, l});
    push(Pair{r, r});
    push(Pair{l, r});
    return;
  }
  if (split_b) examine(p.b);
  if (split_a && split_b) {
    for (NodeIndex a : {Hierarchy::left(p.a), h.right(p.a)})
      for (NodeIndex b : {Hierarchy::left(p.b), h.right(p.b)}) push(Pair{a, b});
  } else if (split_a) {
    for (NodeIndex a : {Hierarchy::left(p.a), h.right(p.a)}) push(Pair{a, p.b});
  } else {
    for (NodeIndex b : {Hierarchy::left(p.b), h.right(p.b)}) push(Pair{p.a, b});
  }
}

template <class Examine, class Push>
void visit(const Scenery& s, Pair p, Worker& worker, Examine&& examine, Push&& push) {
  worker.heed_cancellation();
  ++worker.node_pairs;
  if (!enabled(s, p) || !overlaps(s, p)) return;
  if (is_leaf_pair(s, p))
    test_leaves(s, p, worker);
  else
    refine(s.hierarchy, p, examine, push);
}

}  // namespace hpccd::paper
