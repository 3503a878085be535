// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <limits>

#include "elementary/distance/distance_batch.h"
#include "traverse/leaf_hulls.h"
#include "traverse/pair_pool.h"
#include "traverse/snapshot_boxes.h"
#include "traverse/worker.h"

namespace hpccd {
namespace {

#include "traverse/walk.inl"

// Down to blocks, whose leaf boxes are compared in lanes.
struct SnapshotBoxes {
  using Ends = AtBlocks;
  static constexpr bool shrink = false;
  float reach;
  const SnapshotSearch& search;
  bool overlap(const Node& a, const Node& b) const { return a.near_in_snapshot(b, reach); }
  bool within(const Node&) const { return true; }
  std::uint32_t leaf_pairs(const Block& a, const Block& b, LeafPair* found) const {
    return search.block_pairs(search.tree, a, b, reach, found);
  }
};

// The meshes of a pair, by one vertex of each feature.
std::pair<std::uint32_t, std::uint32_t> meshes_of(const NearestPairs& nearest, const Geometry& g, Kind kind,
                                                  std::uint32_t first, std::uint32_t second) {
  const std::uint32_t a = kind == Kind::vertex_face ? first : g.edges[first][0];
  const std::uint32_t b = kind == Kind::edge_edge ? g.edges[second][0] : g.faces[second][0];
  return {nearest.mesh_of(a), nearest.mesh_of(b)};
}

// Leaves whose boxes are near, although their hulls are provably farther apart.
bool apart_by_hulls(const Tree& tree, LeafPair pair, float reach, const Worker& worker) {
  const bool hulls_tell = pair.first != pair.second && reach > 0 && reach < std::numeric_limits<float>::infinity() &&
                          !tree.grown && !tree.bent;
  if (!hulls_tell || !worker.boxes_leave_much()) return false;
  const LeafRange &a = tree.leaves[pair.first], &b = tree.leaves[pair.second];
  return !share_a_vertex(tree, a, b) && farther_apart(tree, a, b, reach);
}

}  // namespace

SnapshotSearch::SnapshotSearch(const Tree& tree, const PairRules& rules, Simd simd) : Search(tree, rules, simd) {
  std::ranges::fill(batch_test, proximity_batch(simd)), std::ranges::fill(fallback, decide_proximity);
}

void SnapshotSearch::traverse(ThreadPool& pool, std::vector<Worker>& workers) {
  if (placed) return traverse_placed(*this, pool, workers);
  traverse_all(SnapshotBoxes{reach, *this}, *this, pool, workers);
}

bool ProximitySearch::take(Kind kind, const Contact& pair, std::vector<Contact>& list) {
  Contact surfaces = pair;
  if (geometry.separations.thick())
    surfaces.toc = std::min(pair.toc - geometry.separations.thickness_of(kind, pair.first, pair.second),
                            geometry.separations.uniform);
  return Search::take(kind, surfaces, list);
}

void ProximitySearch::test_leaves(LeafPair pair, Worker& worker) const {
  fit(pair);
  if (apart_by_hulls(tree, pair, reach, worker)) return;
  const std::uint32_t mesh_a = tree.node_of_leaf(pair.first).mesh, mesh_b = tree.node_of_leaf(pair.second).mesh;
  const Rule rule = rules.rule(mesh_a, mesh_b);
  const TestedFeatures features = tested(rule, mesh_a, mesh_b);
  worker.test_candidates(rule, [&](CandidateBuffer& edge_edge, CandidateBuffer& vertex_face) {
    leaf_pairs(tree, tree.leaves[pair.first], tree.leaves[pair.second], features, reach, edge_edge, vertex_face);
  });
}

void IntersectionSearch::test_leaves(LeafPair pair, Worker& worker) const {
  fit(pair);
  const Rule rule = rules.rule(tree.node_of_leaf(pair.first).mesh, tree.node_of_leaf(pair.second).mesh);
  worker.test_edge_faces(rule, [&](CandidateBuffer& edge_face) {
    leaf_edge_faces(tree, tree.leaves[pair.first], tree.leaves[pair.second], edge_face);
  });
}

bool DistanceSearch::take(Kind kind, const Contact& pair, std::vector<Contact>&) {
  const auto [a, b] = meshes_of(nearest, geometry, kind, pair.first, pair.second);
  const double lack = nearest.lack(a, b, geometry.separations.thickness_of(kind, pair.first, pair.second));
  return nearest.offer(a, b,
                       {pair.toc + (kind == Kind::edge_face ? 0 : lack), kind, pair.first, pair.second, pair.toc});
}

double DistanceSearch::limit_of(Kind kind, std::uint32_t first, std::uint32_t second) const {
  const auto [a, b] = meshes_of(nearest, geometry, kind, first, second);
  return nearest.limit(a, b) - nearest.lack(a, b, geometry.separations.thickness_of(kind, first, second));
}

void DistanceSearch::test_leaves(LeafPair pair, Worker& worker) const {
  fit(pair);
  const Node &node_a = tree.node_of_leaf(pair.first), &node_b = tree.node_of_leaf(pair.second);
  const LeafRange &a = tree.leaves[pair.first], &b = tree.leaves[pair.second];
  const Rule rule = rules.rule(node_a.mesh, node_b.mesh);
  // If boxes of leaves do not touch, their features do not either.
  if (pair.first == pair.second || node_a.near_in_snapshot(node_b, 0))
    worker.test_edge_faces(rule, [&](CandidateBuffer& edge_face) { leaf_edge_faces(tree, a, b, edge_face); });
  const double limit = nearest.limit(node_a.mesh, node_b.mesh);
  if (limit < 0) return;  // they intersect
  const float reach = nearest.reach(node_a.mesh, node_b.mesh);
  const bool first_look = reach == std::numeric_limits<float>::infinity();
  const FineBoxes* fine = nearest.fine();
  const bool far =
      !fine && node_a.mesh != node_b.mesh && !first_look && far_apart(node_a, node_b, reach) && !tree.grown;
  if (far ? farther_apart(tree, a, b, reach) : !fine && apart_by_hulls(tree, pair, reach, worker)) return;
  worker.test_candidates(rule, [&](CandidateBuffer& edge_edge, CandidateBuffer& vertex_face) {
    constexpr TestedFeatures whole_surfaces;
    if (fine)
      fine->add_near(a, b, limit, edge_edge, vertex_face);
    else
      (far ? far_pairs : leaf_pairs)(tree, a, b, whole_surfaces, reach, edge_edge, vertex_face);
  });
  if (first_look) worker.flush();  // any bound is better than none
}

void DistanceSearch::traverse(ThreadPool& pool, std::vector<Worker>& workers) {
  if (placed) return traverse_placed(*this, pool, workers);
  traverse_all(NearerBoxes<AsFitted>(tree, nearest), *this, pool, workers);
}

}  // namespace hpccd
