// SPDX-License-Identifier: Apache-2.0
// Meshes that keep their shape, at poses. Their tree is built once; a new pose costs nothing per vertex. Each node has
// a box in the frame of its mesh; its bounds in the scene are computed where the search visits it. The positions of a
// leaf's corners are computed, and its rows filled, where the search reaches the leaf: then everything that tests
// features works as if the tree had been fitted to the positions.
#pragma once

#include <array>
#include <atomic>
#include <span>
#include <vector>

#include "base/parallel.h"
#include "base/simd/four.h"
#include "bvh/motion_bounds.h"
#include "bvh/tree.h"
#include "rigid/pose.h"

namespace hpccd {

class PlacedMeshes {
 public:
  // One mesh: x -> rotation (x - center) + shift takes boxes in its frame to those of the scene, by columns.
  struct Placed {
    rigid::Pose pose;
    rigid::Placing placing{pose};
    const double* shape = nullptr;
    std::uint32_t first_vertex = 0;
    Extent local;              // in its own frame
    double center[3] = {};     // of that extent
    double scale = 1;          // of its boxes
    double largest = 0;        // coordinate, in its own frame
    std::uint32_t fitted = 0;  // the state of its vertices and leaves that are fitted to this pose
    Floats4 axes[3], extents[3], slanted_axes[3], slanted_extents[3];
    Floats4 shift, slanted_shift, margin, slanted_margin;
  };

  // All meshes of the scene have a shape. The arguments must outlive the object.
  PlacedMeshes(const Scene& scene, const Features& features, ThreadPool& pool);

  // At these poses, by number of mesh. Builds the tree at the first call. False where floats would hardly distinguish
  // the features of the scene, or coordinates may be too large: the query must be that of the positions.
  bool place(std::span<const rigid::Pose> poses);

  Tree& tree() { return tree_; }
  const Tree& tree() const { return tree_; }
  // Positions only of vertices that were fitted; extents contain the meshes, but are not the least ones.
  const MotionBounds& snapshot() const { return snapshot_; }

  // The position of any vertex, whether or not it is fitted.
  Vec3<double> position(std::uint32_t vertex) const {
    const Placed& mesh = meshes_[features_.mesh_of_vertex[vertex]];
    const double* x = mesh.shape + 3 * std::size_t{vertex - mesh.first_vertex};
    return mesh.placing({x[0], x[1], x[2]});
  }
  // A node with bounds that contain its features at the pose, as of one snapshot (bvh/tree.h).
  Node at_pose(const Node& node) const;

  // The data of at_pose() and position(), by mesh and by node: devices have a copy (gpu/placed_search.h).
  const std::vector<Placed>& meshes() const { return meshes_; }
  const std::vector<Box>& local_boxes() const { return local_; }

  // Fits a leaf, or vertices alone. Several threads may do so at a time.
  void fit(std::uint32_t leaf);
  void fit_vertices(std::span<const std::uint32_t> vertices);

  std::size_t bytes() const;

 private:
  void measure();
  void build_tree();
  void fit_local_boxes();
  Extent extent_of(const Placed& mesh) const;
  void map_boxes(Placed& mesh);
  void fit_vertex(std::uint32_t vertex, std::uint32_t fitted);

  const Scene& scene_;
  const Features& features_;
  ThreadPool& pool_;
  std::vector<Placed> meshes_;
  double finest_ = 0;  // the length of the finest features, see MotionBounds::spread
  Tree tree_;
  MotionBounds snapshot_;
  std::vector<Box> local_;            // by node, in the frame of its mesh
  std::vector<std::uint32_t> mixed_;  // nodes of several meshes
  // A state below the mesh's `fitted`: of another pose. That minus one: a thread is at it.
  std::vector<std::uint32_t> vertex_state_, leaf_state_;
  std::uint32_t last_state_ = 0;
  bool built_ = false, placed_ = false;
};

// The position of a vertex, from its mesh's pose if there are placed meshes.
inline std::array<double, 3> position(const MotionBounds& snapshot, const PlacedMeshes* placed, std::uint32_t vertex) {
  if (placed) {
    const Vec3<double> x = placed->position(vertex);
    return {x.x, x.y, x.z};
  }
  const double* x = snapshot.vertices[vertex].t0;
  return {x[0], x[1], x[2]};
}

}  // namespace hpccd
