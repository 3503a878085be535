// SPDX-License-Identifier: Apache-2.0
// Vertices that were outside a closed mesh in the snapshot before, each with a lower bound of its distance from the
// surface, its clearance. In the straight motion to the present snapshot, a vertex that moves less than its clearance
// relative to all vertices of the mesh does not meet the surface: it is still outside, and what is left of the
// clearance serves the next snapshot.
#pragma once

#include <vector>

#include "base/parallel.h"
#include "bvh/motion_bounds.h"
#include "bvh/tree.h"
#include "scene/features.h"

namespace hpccd {

class OutsideList {
 public:
  // n: number of vertices that it may be asked for. Nothing is known of them at first.
  OutsideList(const MotionBounds& snapshot, VertexRange of_mesh, std::size_t n, ThreadPool& pool);

  // To the next snapshot. If this is cancelled, nothing is known of any vertex.
  void follow(const MotionBounds& snapshot, ThreadPool& pool);
  // Whether a vertex is certainly outside, once in each snapshot. i: its number in the list.
  bool still_outside(const MotionBounds& snapshot, std::size_t i, std::uint32_t vertex);
  // It is not certain from the motion, but the vertex is outside. Measures its clearance, unless those of the vertex
  // have not lasted.
  void measure(const Tree& tree, const MotionBounds& snapshot, const Features& features, std::uint32_t mesh,
               std::size_t i, std::uint32_t vertex);

  std::size_t bytes() const {
    return sizeof *this + mesh_.capacity() * sizeof(mesh_[0]) + listed_.capacity() * sizeof(listed_[0]);
  }

 private:
  struct Point {
    double x[3];
  };
  struct Listed {
    Point at;
    double clearance = 0;
    std::uint32_t followed = 0;  // until which snapshot, by number
    int lasted = -1;             // snapshots for which the clearance was enough; -1: none was measured
    int rests = 0;               // snapshots until the next one is measured
  };

  VertexRange of_mesh_;
  std::uint32_t number_ = 1;  // of the snapshot
  std::vector<Point> mesh_;
  std::vector<Listed> listed_;
  Extent moved_;  // by axis, the least and the largest displacement of the mesh's vertices since the snapshot before
};

}  // namespace hpccd
