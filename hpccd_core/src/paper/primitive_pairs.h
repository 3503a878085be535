// SPDX-License-Identifier: Apache-2.0
// Representative triangles (Kim et al. 2009, section 6; Curtis et al. 2008): a pair of triangles represents the pairs
// of the features that are assigned to them, so that no two pairs of triangles lead to the same elementary test.
#pragma once

#include <vector>

#include "bvh/box.h"
#include "scene/features.h"
#include "scene/pair_rules.h"
#include "traverse/leaf_pairs.h"
#include "traverse/worker.h"

namespace hpccd::paper {

struct BoundedPrimitive {
  std::uint32_t number;
  const Box& box;
};

// Appends the feature pairs of two different primitives whose boxes overlap and that share no vertex: the rule of
// traverse/leaf_pairs.inl, so that all methods test the same pairs.
void primitive_pairs(const Features& features, const std::vector<Box>& vertex_boxes, BoundedPrimitive a,
                     BoundedPrimitive b, TestedFeatures tested, CandidateBuffer& edge_edge,
                     CandidateBuffer& vertex_face);

// Their elementary tests. Inline: it is called for each pair of leaves (otherwise the traversal took 5 % longer).
inline void test_primitives(const Features& features, Rule rule, const std::vector<Box>& vertex_boxes,
                            BoundedPrimitive a, BoundedPrimitive b, Worker& worker) {
  worker.test_candidates(rule, [&](CandidateBuffer& edge_edge, CandidateBuffer& vertex_face) {
    primitive_pairs(features, vertex_boxes, a, b, rule.features, edge_edge, vertex_face);
  });
}
// The same for two primitives by number, by the rule of their meshes.
void test_primitives(const Features& features, const PairRules& rules, const std::vector<Box>& vertex_boxes,
                     LeafPair primitives, Worker& worker);

}  // namespace hpccd::paper
