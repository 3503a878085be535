// SPDX-License-Identifier: Apache-2.0
// Which meshes lie inside others, in snapshots of one scene. Where the surfaces of two meshes do not touch, all points
// of a connected component of one have the same winding number with respect to the other: one vertex decides.
#pragma once

#include <deque>
#include <memory>
#include <span>
#include <unordered_map>
#include <vector>

#include "base/parallel.h"
#include "bvh/motion_bounds.h"
#include "bvh/placed_meshes.h"
#include "bvh/tree.h"
#include "hpccd/results.h"
#include "scene/pair_rules.h"
#include "solid/outside_list.h"
#include "traverse/mesh_pairs.h"

namespace hpccd {

// What the decisions of one world leave for its next snapshot. It affects only how much is computed: each result is
// that of a new detector.
struct ContainmentMemory {
  struct OfPair {
    std::uint32_t found = Tree::none;      // the vertex that was inside last
    std::unique_ptr<OutsideList> outside;  // of the components, where many are near the other mesh, and all outside
  };
  // By twice the number of the pair of meshes, plus 1 if the second one may be inside.
  std::unordered_map<std::size_t, OfPair> of_pair;

  std::size_t bytes() const;
};

class Containment {
 public:
  // The arguments must outlive the object.
  Containment(const Scene& scene, const Features& features, const PairRules& rules, const MeshPairs& pairs,
              const Cancellation& cancellation);

  // Sets Gap::inside of each pair of meshes, in the order of the pairs. The tree is that of the snapshot; placed: its
  // meshes if they are at poses, otherwise null. Throws Cancelled.
  void decide(std::span<Gap> gaps, const Tree& tree, const MotionBounds& snapshot, const PlacedMeshes* placed,
              ContainmentMemory& memory, ThreadPool& pool) const;

  // One vertex of each connected component of a mesh that is in a pair.
  std::span<const std::uint32_t> components(std::uint32_t mesh) const {
    return {vertices_.data() + first_[mesh], vertices_.data() + first_[mesh + 1]};
  }
  // Whether one mesh may lie inside another, as far as their boxes tell.
  bool possible(std::uint32_t inner, std::uint32_t outer, bool boxes_meet, bool within_box) const {
    return closed_[outer] && (components(inner).size() == 1 ? within_box : boxes_meet);
  }

  std::size_t bytes() const { return closed_.capacity() + 4 * (first_.capacity() + vertices_.capacity()); }

 private:
  struct Question;
  Extent least_extent(std::uint32_t mesh, const MotionBounds& snapshot, const PlacedMeshes& placed) const;
  std::deque<Question> questions_of(std::span<Gap> gaps, const MotionBounds& snapshot,
                                    const PlacedMeshes* placed) const;

  const Scene& scene_;
  const Features& features_;
  const PairRules& rules_;
  const MeshPairs& pairs_;
  std::vector<char> closed_;                     // by mesh
  std::vector<std::uint32_t> first_, vertices_;  // by mesh, one vertex of each connected component
};

}  // namespace hpccd
