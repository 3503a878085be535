// SPDX-License-Identifier: Apache-2.0
// The state that all threads share during one call, and a type for each query. The type defines which boxes overlap
// (traverse), which pairs of features of two leaves are candidates (test_leaves), their batch tests and fallbacks, and
// where results go (take). Batches and threads are the same for all queries.
#pragma once

#include <atomic>
#include <limits>
#include <vector>

#include "base/cancellation.h"
#include "base/parallel.h"
#include "elementary/batch.h"
#include "elementary/fallback.h"
#include "elementary/intersection_batch.h"
#include "elementary/policy.h"
#include "scene/feature_filter.h"
#include "traverse/drift.h"
#include "traverse/far_pairs.h"
#include "traverse/leaf_edge_faces.h"
#include "traverse/leaf_pairs.h"
#include "traverse/nearest_pairs.h"
#include "traverse/tasks.h"

namespace hpccd {

class Worker;

struct Search {
  Search(const Tree& tree, const PairRules& rules, Simd simd) : tree(tree), rules(rules), simd(simd) {}
  virtual ~Search() = default;
  // Runs the elementary tests of two leaves, at the accuracy of their meshes.
  virtual void test_leaves(LeafPair pair, Worker& worker) const = 0;
  // Depth first, by threads that share their remaining work (pair_pool.h). Results remain in the workers, one per
  // thread of the pool, unless the query takes them.
  virtual void traverse(ThreadPool& pool, std::vector<Worker>& workers) = 0;

  const Tree& tree;
  const PairRules& rules;
  const Simd simd;
  Geometry geometry{};
  const FilterView* filter = nullptr;  // for pairs of meshes with a filter
  // Tests of pairs of features, by number of the rule; edge-face tests are the same for all rules.
  BatchTest batch_test[n_rules];
  Fallback fallback[n_rules];
  const IntersectionBatch intersection_batch = hpccd::intersection_batch(simd);
  Report report = Report::all;
  std::atomic<double> earliest = std::numeric_limits<double>::infinity();  // best time so far, for report "first"
  bool time_only = false;  // only the earliest time is requested; it must never be late
  bool prunes = false;     // pairs that cannot touch before the best time are skipped
  // Pairs that touch later do not matter. 1 or more: all pairs matter.
  float until() const {
    const double best = earliest.load(std::memory_order_relaxed);
    return prunes && best < 1 ? static_cast<float>(best + same_time) * (1 + 2e-7f) : 2;
  }
  // Stores a pair that was found, in the worker's list or elsewhere. True: the remaining search has become smaller.
  virtual bool take(Kind, const Contact& pair, std::vector<Contact>& list) {
    if (report == Report::first) {
      double best = earliest.load(std::memory_order_relaxed);
      if (pair.toc > best) return false;
      while (pair.toc < best && !earliest.compare_exchange_weak(best, pair.toc, std::memory_order_relaxed)) {
      }
    }
    list.push_back(pair);
    return false;
  }
  // The distance up to which a pair counts: its separation, or a limit that decreases during the search.
  bool limits_fall = false;
  virtual double limit_of(Kind kind, std::uint32_t first, std::uint32_t second) const {
    std::uint32_t v[4];
    pair_vertices(geometry, kind, first, second, v);
    return geometry.separations.look_up(kind, first, second, v);
  }
  // A search that is worthwhile only for few results gives up above most_found. n_found: results so far.
  std::size_t most_found = std::numeric_limits<std::size_t>::max();
  std::atomic<std::size_t> n_found = 0;
  bool bounded() const { return most_found < std::numeric_limits<std::size_t>::max(); }
  bool gave_up() const { return bounded() && n_found.load(std::memory_order_relaxed) > most_found; }
  const Cancellation* cancellation = &never_cancelled;
  // Null if no mesh has points.
  const EdgeKind* edge_kinds = nullptr;
  const unsigned char* edge_kinds_of_mesh = nullptr;
  // Which features of two meshes are tested. A mesh of points and one whose edges are all of faces have no edge-edge
  // pairs.
  TestedFeatures tested(const Rule& rule, std::uint32_t mesh_a, std::uint32_t mesh_b) const {
    TestedFeatures features = rule.features;
    if (!edge_kinds_of_mesh || mesh_a == mixed_meshes || mesh_b == mixed_meshes) return features;
    if (all_never_paired(edge_kinds_of_mesh[mesh_a], edge_kinds_of_mesh[mesh_b])) features.edge_edge = false;
    return features;
  }
};

// The part of a motion that matters.
struct PartOfMotion {
  float until;  // end of the part; 1 or more: the whole motion
  float reach;  // until then features stay within boxes at the start grown by this; negative: too large
};

// Contacts of a motion: all of them, any one, or the earliest.
struct ContactSearch final : Search {
  // fast_by_floats: pairs of tier `fast` are tested in single precision, otherwise as "balanced".
  ContactSearch(const Tree& tree, const PairRules& rules, Simd simd, bool fast_by_floats = true);

  const BlockPairs block_pairs = hpccd::block_pairs(simd);
  const LeafPairs leaf_pairs = hpccd::leaf_pairs(simd);
  // For two meshes whose boxes have grown by more than their separation requires: the excess, and the remaining pairs.
  Excess excess;
  const BlockPairsLessExcess block_pairs_less_excess = hpccd::block_pairs_less_excess(simd);
  const LeafPairsLessExcess leaf_pairs_less_excess = hpccd::leaf_pairs_less_excess(simd);
  // For a part of the motion when searching for the earliest contacts; also by boxes at the start only.
  const BlockPairsUntil block_pairs_until = hpccd::block_pairs_until(simd);
  const LeafPairsUntil leaf_pairs_until = hpccd::leaf_pairs_until(simd);
  const LeafPairsInSnapshot leaf_pairs_at_start = hpccd::leaf_pairs_at_start(simd);
  // In coordinates of the boxes: twice the longest displacement of a vertex along an axis, and how much boxes at the
  // start may grow without reaching the neighbours of their neighbours.
  float two_ways = std::numeric_limits<float>::infinity(), most_reach = 0;
  PartOfMotion part() const {
    if (!prunes || !(earliest.load(std::memory_order_relaxed) < 1)) return {2, -1};
    const float time = until(), reach = time * two_ways * (1 + 1e-6f) + 1e-6f;
    return {time, reach <= most_reach ? reach : -1};
  }
  // No further result can matter.
  bool over() const { return time_only && earliest.load(std::memory_order_relaxed) <= 0; }

  void test_leaves(LeafPair pair, Worker& worker) const override;
  // For report "any": independent tasks in order, so that the result does not depend on threads.
  void traverse(ThreadPool& pool, std::vector<Worker>& workers) override;
  // Searches for pairs that may touch and are not listed, when the near pairs of a snapshot are.
  void traverse_unlisted(const Drift& drift, ThreadPool& pool, std::vector<Worker>& workers);

 private:
  void traverse_less_excess(ThreadPool& pool, std::vector<Worker>& workers);
};

// Queries of one snapshot: pairs whose boxes are at most `reach` apart along every axis, in coordinates of the boxes.
struct SnapshotSearch : Search {
  SnapshotSearch(const Tree& tree, const PairRules& rules, Simd simd);
  float reach = 0;
  const BlockPairsInSnapshot block_pairs = block_pairs_in_snapshot(simd);
  // The meshes of the tree if they are at poses: leaves are fitted where they are tested.
  PlacedMeshes* placed = nullptr;
  void fit(LeafPair pair) const {
    if (placed) placed->fit(pair.first), placed->fit(pair.second);
  }
  void traverse(ThreadPool& pool, std::vector<Worker>& workers) override;
};

// Vertex-face and edge-edge pairs within a distance.
struct ProximitySearch final : SnapshotSearch {
  using SnapshotSearch::SnapshotSearch;
  const LeafPairsInSnapshot leaf_pairs = leaf_pairs_in_snapshot(simd);
  // Distances of surfaces: less the thickness of both features.
  bool take(Kind kind, const Contact& pair, std::vector<Contact>& list) override;
  void test_leaves(LeafPair pair, Worker& worker) const override;
};

// Edges that intersect faces.
struct IntersectionSearch final : SnapshotSearch {
  using SnapshotSearch::SnapshotSearch;
  const LeafEdgeFaces leaf_edge_faces = hpccd::leaf_edge_faces(simd);
  void test_leaves(LeafPair pair, Worker& worker) const override;
};

// The smallest distance of each pair of meshes.
struct DistanceSearch final : SnapshotSearch {
  DistanceSearch(const Tree& tree, const PairRules& rules, Simd simd, NearestPairs& nearest)
      : SnapshotSearch(tree, rules, simd), nearest(nearest) {
    limits_fall = true;
  }
  const LeafPairsInSnapshot leaf_pairs = leaf_pairs_in_snapshot(simd);
  const LeafPairsInSnapshot far_pairs = hpccd::far_pairs(simd);  // for nearest leaves that are far apart
  const LeafEdgeFaces leaf_edge_faces = hpccd::leaf_edge_faces(simd);
  NearestPairs& nearest;  // the results
  bool take(Kind kind, const Contact& pair, std::vector<Contact>& list) override;
  double limit_of(Kind kind, std::uint32_t first, std::uint32_t second) const override;
  void test_leaves(LeafPair pair, Worker& worker) const override;
  void traverse(ThreadPool& pool, std::vector<Worker>& workers) override;
};

}  // namespace hpccd
