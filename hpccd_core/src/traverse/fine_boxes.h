// SPDX-License-Identifier: Apache-2.0
// Boxes and candidates in double precision, for smallest distances in scenes whose features are so small that floats
// hardly distinguish them (MotionBounds::spread). For two bodies of size 1 at a distance of 1e7, all pairs of features
// have the same distance in floats.
#pragma once

#include <vector>

#include "bvh/motion_bounds.h"
#include "bvh/tree.h"
#include "traverse/leaf_pairs.h"

namespace hpccd {

class FineBoxes {
 public:
  // The arguments must outlive the object.
  FineBoxes(const Tree& tree, const MotionBounds& snapshot);

  // The square of the distance of the boxes of two nodes, by number.
  double square_of_gap(std::uint32_t a, std::uint32_t b) const;
  // Whether the boxes of two nodes are certainly farther apart than a distance.
  bool farther_apart(std::uint32_t a, std::uint32_t b, double distance) const;
  // Appends the pairs of features of two leaves, or of one, that share no vertex and are not certainly farther apart
  // than a distance.
  void add_near(const LeafRange& a, const LeafRange& b, double distance, CandidateBuffer& edge_edge,
                CandidateBuffer& vertex_face) const;

 private:
  struct Bounds {
    double low[3], high[3];
  };

  const Tree& tree_;
  const MotionBounds& snapshot_;
  std::vector<Bounds> nodes_;
};

}  // namespace hpccd
