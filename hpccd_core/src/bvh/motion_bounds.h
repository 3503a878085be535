// SPDX-License-Identifier: Apache-2.0
// Checks the caller's positions, stores both ends of each vertex's motion together, and bounds the motion.
#pragma once

#include <cmath>
#include <span>
#include <vector>

#include "base/parallel.h"
#include "bvh/coordinate_map.h"
#include "bvh/kdop.h"
#include "bvh/motion_box.h"
#include "bvh/slanted_direction.h"
#include "bvh/squeezed_axis.h"
#include "scene/features.h"
#include "scene/static_meshes.h"
#include "scene/vertex_motion.h"

namespace hpccd {

// A part of the vertices that moves or rests as a whole: those of one mesh.
struct VertexRange {
  std::size_t begin, end;
};

// Features smaller than this, in coordinates of the boxes, count as spread: the rounding of a reach, 1e-6, is a tenth
// of it. For larger features, exact distances cost more than they save: with a vertex 3,000 sizes away from a grid of
// 5,000 triangles, smallest distances took 16 ms instead of 2.5.
inline constexpr double least_spread = 1e-5;

// Smallest and largest coordinates.
struct Extent {
  double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
  bool good = true;  // all coordinates are finite and not too large
  void include(const Extent& e);
};

// By how much boxes grow beyond their vertices, so that those of features within their separation overlap.
struct Growth {
  std::span<const double> separations;    // by mesh, the largest of its pairs; empty: none
  const double* thickness = nullptr;      // by vertex; null: none
  std::span<const double> thickest = {};  // by mesh
  std::uint64_t version_of_thickness = 0;
};

struct MotionBounds {
  // Their edges show how fine the scene is. Without features the scene counts as coarse.
  const Features* features = nullptr;
  // The boxes at the end contain the whole way, so that those of any shorter motions lie within them.
  bool of_any_part = false;
  std::vector<VertexMotion> vertices;
  std::vector<MotionBox> boxes;
  bool grown = false;  // some contain more than their vertex: half a separation around it
  std::vector<VertexKdop> kdops;
  std::vector<RoundedMotion> rounded;  // empty without k-DOPs
  bool has_kdops() const { return !snapshot_; }
  CoordinateMap map;
  // The length of a short edge (scene/edge_sample.h): its largest extent along an axis, at the end of the motion at
  // which it is shorter.
  double short_edge = 0;
  // Whether features are so small compared with the scene that floats hardly distinguish them. Then each axis, and each
  // slanted direction of a snapshot, has its own map for boxes if that is finer. Otherwise boxes use the common map.
  bool spread = false;
  std::vector<SqueezedAxis> squeezed;
  // For boxes: the scale of their map, and `rounding` in their coordinates.
  double box_scale = 1, box_rounding = 0;
  // Rounding errors of sums of two coordinates, in units of the scene: 2.2e-16 of the largest for each of two vertices,
  // 3.4e-16 if one is doubled. Far from the origin this exceeds the rounding to floats.
  double rounding = 0;
  // By mesh: whether its vertices and boxes are unchanged since the previous call. Empty: no mesh.
  std::vector<char> resting;
  // Boxes of the whole sweep, for methods that need them.
  std::vector<Box> swept;

  // Boxes of features that come within their separation of each other overlap as well. Throws InvalidArgument if a
  // coordinate is not finite or too large, or if a static mesh moves.
  void update(const Scene& scene, Positions vertices_t0, Positions vertices_t1, const Growth& growth, ThreadPool& pool);
  // For one snapshot: a motion without displacement, whose boxes have bounds along other directions in place of the
  // second end (SlantedDirection); without k-DOPs. `distance`: features count as near up to this distance, if it is
  // known.
  void update(const Scene& scene, Positions vertices, ThreadPool& pool, double distance = 0);
  // Other ends of these vertices, within the boxes that they have.
  void shorten(Positions vertices_t0, Positions vertices_t1, std::span<const std::uint32_t> changed, ThreadPool& pool);
  // For a snapshot of meshes at poses (bvh/placed_meshes.h): extents that contain them. Positions and boxes of vertices
  // follow one by one, when they are needed.
  void begin_placed(std::vector<Extent> of_meshes);
  // The same for vertices without a scene, without separations.
  void update(Positions vertices_t0, Positions vertices_t1, ThreadPool& pool);
  void sweep(ThreadPool& pool);
  // Smallest and largest coordinates of its vertices.
  const Extent& extent_of_mesh(std::size_t mesh) const { return extents_[mesh]; }
  // The amount by which its boxes have grown for separations of pairs of meshes, in the scene's coordinates.
  double margin_of_mesh(std::size_t mesh) const { return margins_[mesh]; }
  // The largest amount by which its boxes have grown.
  double growth_of_mesh(std::size_t mesh) const { return margins_[mesh] + (thickest_.empty() ? 0 : thickest_[mesh]); }
  // The largest amount for k-DOPs of some of its vertices. Along a diagonal the scene is up to twice as long as along
  // an axis, so the growth of boxes, which ends where they contain the scene, would not suffice.
  double kdop_growth(std::size_t mesh, std::span<const std::uint32_t> of_vertices) const {
    if (!thickness_ || !(thickest_[mesh] > 0)) return margins_[mesh];
    double most = 0;
    for (const std::uint32_t v : of_vertices) most = std::max(most, thickness_[v]);
    return margins_[mesh] + (thicker_than_scene_ ? 2 : 1) * thickness_in_box(most);
  }
  // Whether boxes have grown by less than their thickness, because it exceeds the scene.
  bool thicker_than_scene() const { return thicker_than_scene_; }
  std::size_t bytes() const;

 private:
  void divide(const Scene& scene);
  template <class Real>
  void update(const Real* t0, const Real* t1, std::size_t n, const Growth& growth, ThreadPool& pool);
  void update_all(Positions t0, Positions t1, const Growth& growth, ThreadPool& pool);
  auto squeezed_map() const {
    return [this](double x, int k) { return squeezed[static_cast<std::size_t>(k)](x); };
  }
  template <class Real>
  void copy(const Real* t0, const Real* t1, std::size_t begin, std::size_t end, std::size_t part);
  double thickness_in_box(double thickness) const;
  template <class Real>
  void measure_edges(const Real* t0, const Real* t1);
  double finest() const;
  template <class Real>
  void squeeze(const Real* t0, const Real* t1, std::size_t n, double finest, const Extent& whole, ThreadPool& pool);

  StaticMeshes statics_;
  std::vector<VertexRange> parts_;     // of each mesh
  std::vector<Extent> extents_;        // range of each part when it was last computed
  std::vector<double> margins_;        // of each part's boxes
  const double* thickness_ = nullptr;  // Growth::thickness, during a call
  std::vector<double> thickest_;       // of each part, as in its boxes; empty: none
  std::uint64_t version_of_thickness_ = 0;
  double scene_size_ = 0, largest_here_ = 0;  // the scene's largest extent and coordinate
  bool thicker_than_scene_ = false;
  std::array<SlantedDirection, 3> slanted_;
  double distance_ = 0, largest_ = largest_coordinate;
  bool snapshot_ = false, was_snapshot_ = false;
  bool complete_ = false;  // false during a call, and after it has thrown
};

}  // namespace hpccd
