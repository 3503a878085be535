// SPDX-License-Identifier: Apache-2.0
// Branch and bound for the smallest distance of each pair of meshes: the nearest pair of features so far, and which
// pairs it leaves to be searched. Shared by all threads.
#pragma once

#include <algorithm>
#include <atomic>
#include <memory>
#include <vector>

#include "base/spin_lock.h"
#include "bvh/motion_bounds.h"
#include "bvh/placed_meshes.h"
#include "bvh/tree.h"
#include "elementary/pair.h"
#include "scene/feature_filter.h"
#include "scene/pair_rules.h"
#include "scene/thickness.h"
#include "traverse/fine_boxes.h"
#include "traverse/mesh_pairs.h"

namespace hpccd {

struct NearestPair {
  // That of the surfaces, plus the largest thickness of both meshes: then bounds by boxes hold for each thickness.
  double distance = std::numeric_limits<double>::infinity();
  Kind kind = Kind::edge_face;
  std::uint32_t first = 0xFFFFFFFFu, second = 0xFFFFFFFFu;
  double without_thickness = distance;

  // Order of results: edges and faces that intersect first, then by distance, then canonical order.
  bool before(const NearestPair& other) const;
};

class NearestPairs {
 public:
  // The arguments must outlive the object. The tree has its least edges. placed: null, or the meshes of the tree if
  // they are at poses.
  NearestPairs(const MeshPairs& pairs, const PairRules& rules, const FilterView* filter, const Features& features,
               const MotionBounds& motion, const Tree& tree, const ThicknessTable& thickness,
               PlacedMeshes* placed = nullptr);

  // Features farther apart than this along an axis, in coordinates of the boxes, cannot improve the result.
  float reach(std::uint32_t mesh_a, std::uint32_t mesh_b) const {
    if (mesh_a == mixed_meshes || mesh_b == mixed_meshes) return std::numeric_limits<float>::infinity();
    return at(mesh_a, mesh_b).reach.load(std::memory_order_relaxed);
  }
  // Pairs beyond this distance, plus their lack, cannot improve the result; below 0: no pair can.
  double limit(std::uint32_t mesh_a, std::uint32_t mesh_b) const {
    return at(mesh_a, mesh_b).limit.load(std::memory_order_relaxed);
  }
  // By how much the thickness of two features, their sum, is less than the largest of two features of their meshes.
  double lack(std::uint32_t mesh_a, std::uint32_t mesh_b, double of_both) const {
    const std::vector<double>& largest = thickness_.largest_of_meshes();
    return largest.empty() ? 0 : largest[mesh_a] + largest[mesh_b] - of_both;
  }
  // Whether two nodes of the tree, by number, contain an edge that comes before the first one found to intersect a
  // face. With many intersections this ends the search early.
  bool may_come_before(std::uint32_t a, std::uint32_t b) const {
    const std::uint32_t mesh_a = tree_.nodes[a].mesh, mesh_b = tree_.nodes[b].mesh;
    if (mesh_a == mixed_meshes || mesh_b == mixed_meshes) return true;
    return least_edge(a, b) <= at(mesh_a, mesh_b).piercing_edge.load(std::memory_order_relaxed);
  }
  // Boxes in double precision, if floats hardly distinguish features; otherwise null.
  const FineBoxes* fine() const { return fine_.get(); }
  // The lowest edge number in either node.
  std::uint32_t least_edge(std::uint32_t a, std::uint32_t b) const {
    return std::min(tree_.least_edge[a], tree_.least_edge[b]);
  }
  std::uint32_t mesh_of(std::uint32_t vertex) const { return features_.mesh_of_vertex[vertex]; }
  // Offers a pair; returns whether it improves the result.
  bool offer(std::uint32_t mesh_a, std::uint32_t mesh_b, const NearestPair& pair);
  // Called at the first visit of two meshes, with these nodes: an upper bound from two of their vertices excludes pairs
  // that are farther apart.
  void begin(std::uint32_t a, std::uint32_t b);
  // The results after the search, in the order of the pairs.
  const MeshPairs& pairs() const { return pairs_; }
  const NearestPair& found(std::size_t number) const { return entries_[number].best; }

 private:
  struct Entry {
    std::atomic<float> reach{std::numeric_limits<float>::infinity()};
    std::atomic<double> limit{1e307};  // beyond all coordinates; finite, since margins are computed with it
    std::atomic<std::uint32_t> piercing_edge{0xFFFFFFFFu};  // the first pair of edge and face so far
    std::atomic<bool> begun{false};
    SpinLock lock;
    NearestPair best;
  };
  void limit(Entry& entry, double limit);
  double rounding(std::uint32_t mesh_a, std::uint32_t mesh_b) const;
  Entry& at(std::uint32_t a, std::uint32_t b) const { return entries_[pairs_.number(a, b)]; }

  const MeshPairs& pairs_;
  const PairRules& rules_;
  const FilterView* filter_;
  const Features& features_;
  const MotionBounds& motion_;
  const Tree& tree_;
  const ThicknessTable& thickness_;
  PlacedMeshes* const placed_;
  std::unique_ptr<Entry[]> entries_;  // by number of the pair
  std::unique_ptr<FineBoxes> fine_;
  double scale_, sums_, rounding_;
};

}  // namespace hpccd
