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
  // The elementary tests of two leaves, at the accuracy of their meshes.
  virtual void test_leaves(LeafPair pair, Worker& worker) const = 0;
  // Depth first, by threads that share what they have left (pair_pool.h). Leaves what was found in the workers, one per
  // thread of the pool, unless the query takes it itself.
  virtual void traverse(ThreadPool& pool, std::vector<Worker>& workers) = 0;

  const Tree& tree;
  const PairRules& rules;
  const Simd simd;
  Geometry geometry{};
  // How pairs of features are tested, by number of the rule; edges against faces alike by all.
  BatchTest batch_test[n_rules];
  Fallback fallback[n_rules];
  const IntersectionBatch intersection_batch = hpccd::intersection_batch(simd);
  Report report = Report::all;
  std::atomic<double> earliest = std::numeric_limits<double>::infinity();  // best time so far, where report is first
  bool time_only = false;  // the earliest time is all that is asked for, never a late one
  bool prunes = false;     // what cannot touch up to the best time is left out
  // Pairs that touch later do not matter; 1 or more: all do.
  float until() const {
    const double best = earliest.load(std::memory_order_relaxed);
    return prunes && best < 1 ? static_cast<float>(best + same_time) * (1 + 2e-7f) : 2;
  }
  // Takes a pair that was found, to the worker's list or elsewhere. True: less is left to look at.
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
  // The distance up to which a pair counts: its separation, or a limit that falls with what is found.
  bool limits_fall = false;
  virtual double limit_of(Kind kind, std::uint32_t first, std::uint32_t second) const {
    std::uint32_t v[4];
    pair_vertices(geometry, kind, first, second, v);
    return geometry.separations.look_up(v[0], v[2]);
  }
  // A search that pays only where it finds few pairs gives up above most_found. Number found so far: n_found.
  std::size_t most_found = std::numeric_limits<std::size_t>::max();
  std::atomic<std::size_t> n_found = 0;
  bool bounded() const { return most_found < std::numeric_limits<std::size_t>::max(); }
  bool gave_up() const { return bounded() && n_found.load(std::memory_order_relaxed) > most_found; }
  const Cancellation* cancellation = &never_cancelled;
};

// How much of a motion matters.
struct PartOfMotion {
  float until;  // 1 or more: the whole
  float reach;  // up to then features stay within boxes at the start that are so far apart; below 0: too far
};

// Contacts of a motion: all of them, any one, or the earliest.
struct ContactSearch final : Search {
  // fast_by_floats: pairs of tier `fast` are tested in single precision, otherwise as "balanced".
  ContactSearch(const Tree& tree, const PairRules& rules, Simd simd, bool fast_by_floats = true);

  const BlockPairs block_pairs = hpccd::block_pairs(simd);
  const LeafPairs leaf_pairs = hpccd::leaf_pairs(simd);
  // For two meshes whose boxes have grown by more than their separation requires: by how much, and the pairs left.
  Excess excess;
  const BlockPairsLessExcess block_pairs_less_excess = hpccd::block_pairs_less_excess(simd);
  const LeafPairsLessExcess leaf_pairs_less_excess = hpccd::leaf_pairs_less_excess(simd);
  // Of a part of the motion, where the earliest contacts are looked for; also by boxes at the start alone.
  const LeafPairsUntil leaf_pairs_until = hpccd::leaf_pairs_until(simd);
  const LeafPairsInSnapshot leaf_pairs_at_start = hpccd::leaf_pairs_at_start(simd);
  // In coordinates of the boxes: twice the longest way of a vertex along an axis, and how much of it boxes at the start
  // may grow by without reaching their neighbours' neighbours.
  float two_ways = std::numeric_limits<float>::infinity(), most_reach = 0;
  PartOfMotion part() const {
    if (!prunes || !(earliest.load(std::memory_order_relaxed) < 1)) return {2, -1};
    const float time = until(), reach = time * two_ways * (1 + 1e-6f) + 1e-6f;
    return {time, reach <= most_reach ? reach : -1};
  }
  // Nothing that is found could matter any more.
  bool over() const { return time_only && earliest.load(std::memory_order_relaxed) <= 0; }

  void test_leaves(LeafPair pair, Worker& worker) const override;
  // Where any one contact will do, by independent tasks in their order, so that the answer does not depend on threads.
  void traverse(ThreadPool& pool, std::vector<Worker>& workers) override;
  // Of what may touch and is not listed, where pairs that are near in a snapshot are.
  void traverse_unlisted(const Drift& drift, ThreadPool& pool, std::vector<Worker>& workers);

 private:
  void traverse_less_excess(ThreadPool& pool, std::vector<Worker>& workers);
};

// Queries of one snapshot: of what is no farther apart than `reach`, in coordinates of the boxes, along any axis.
struct SnapshotSearch : Search {
  SnapshotSearch(const Tree& tree, const PairRules& rules, Simd simd);
  float reach = 0;
  void traverse(ThreadPool& pool, std::vector<Worker>& workers) override;
};

// Vertex-face and edge-edge pairs within a distance.
struct ProximitySearch final : SnapshotSearch {
  using SnapshotSearch::SnapshotSearch;
  const LeafPairsInSnapshot leaf_pairs = leaf_pairs_in_snapshot(simd);
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
  const LeafPairsInSnapshot far_pairs = hpccd::far_pairs(simd);  // where nearest leaves are far apart
  const LeafEdgeFaces leaf_edge_faces = hpccd::leaf_edge_faces(simd);
  NearestPairs& nearest;  // what was found
  bool take(Kind kind, const Contact& pair, std::vector<Contact>& list) override;
  double limit_of(Kind kind, std::uint32_t first, std::uint32_t second) const override;
  void test_leaves(LeafPair pair, Worker& worker) const override;
  void traverse(ThreadPool& pool, std::vector<Worker>& workers) override;
};

}  // namespace hpccd
