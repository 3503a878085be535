// SPDX-License-Identifier: Apache-2.0
// Vertices that were outside a closed mesh in one snapshot, with their clearance. A vertex is still outside if it has
// moved less than that relative to all vertices of the mesh: in the straight motion of everything from that snapshot to
// the present one, it does not meet the surface.
#pragma once

#include <span>
#include <vector>

#include "base/parallel.h"
#include "bvh/motion_bounds.h"
#include "bvh/tree.h"

namespace hpccd {

// A lower bound of the distance between a vertex and the features of a mesh, from the boxes of the tree.
double clearance_of(const Tree& tree, const MotionBounds& snapshot, std::uint32_t mesh, std::uint32_t vertex);

class OutsideList {
 public:
  // `vertices`: in ascending order; all are outside.
  OutsideList(const Tree& tree, const MotionBounds& snapshot, std::uint32_t mesh, VertexRange of_mesh,
              std::span<const std::uint32_t> vertices, ThreadPool& pool);

  // Compares the mesh with the snapshot of the list. Before still_outside().
  void follow(const MotionBounds& snapshot, ThreadPool& pool);
  // Whether the vertex is listed and certainly outside.
  bool still_outside(const MotionBounds& snapshot, std::uint32_t vertex) const;

  std::size_t size() const { return listed_.size(); }
  // Of how many vertices the list has decided whether they are outside since it was made, and of how many it has not.
  std::size_t decided = 0, open = 0;

  std::size_t bytes() const {
    return sizeof *this + mesh_.capacity() * sizeof(mesh_[0]) + listed_.capacity() * sizeof(listed_[0]);
  }

 private:
  struct Point {
    double x[3];
  };
  struct Listed {
    std::uint32_t vertex;
    Point at;
    double clearance;
  };

  VertexRange of_mesh_;
  std::vector<Point> mesh_;  // in the snapshot of the list
  std::vector<Listed> listed_;
  Extent moved_;  // by axis, the least and the largest displacement of the mesh's vertices since then
};

}  // namespace hpccd
