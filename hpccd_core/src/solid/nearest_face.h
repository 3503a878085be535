// SPDX-License-Identifier: Apache-2.0
// The face of a mesh that is nearest to a point, by branch and bound.
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "solid/mesh_in_tree.h"
#include "solid/nearest_place.h"

namespace hpccd {

struct NearestFace {
  double distance = std::numeric_limits<double>::infinity();
  std::uint32_t face = Tree::none;
  Vec3<double> point{};  // the nearest one on that face
  double error = 0;      // bound of the error of the distance
};

// For one thread. The result for a point does not depend on those before.
class NearestFaceSearch {
 public:
  // The mesh has faces; the argument must outlive the object.
  explicit NearestFaceSearch(const MeshInTree& mesh);

  // Of several faces with the same computed distance, the lowest. near: a face of the mesh that may be near, or
  // Tree::none. The computed distance has an error of at most 1e-13 of the largest distance of the point from the mesh
  // and is never 0 unless the face contains the point.
  NearestFace find(const Vec3<double>& point, std::uint32_t near);

 private:
  struct Pending {
    std::uint32_t node;
    double square_of_gap;
  };
  // Double-precision boxes of the nodes, for scenes whose features are too small for floats.
  struct FineBox {
    double low[3], high[3];
  };

  void begin(const Vec3<double>& point);
  void consider(std::uint32_t face);
  double square_of_distance(std::uint32_t face, double least) const;
  Vec3<double> nearest_point(std::uint32_t face) const;
  template <class Real>
  void search(const Real (&at)[3]);
  void search_fine();
  template <class Real>
  void search_block(const Block& block, const Real (&at)[3]);
  template <class Real>
  void search_leaf(std::uint32_t leaf, const Real (&at)[3]);
  void make_fine_boxes();
  void update_limit();
  ScaledFace scaled(std::uint32_t face) const;

  const MeshInTree& mesh_;
  std::vector<Pending> stack_;
  std::vector<FineBox> fine_;
  // Of the point that is searched now.
  Vec3<double> point_{};
  double scale_ = 1;        // distances and squares below are multiplied by it, and its square
  double slack_ = 0;        // rounding of a distance of a box
  double along_slack_ = 0;  // of a distance along a direction
  double square_ = 0;       // of the distance of the nearest face so far
  double limit_ = 0;        // squares of gaps above it cannot belong to a face as near
  double reach_ = 0;        // distances along a direction, likewise
  std::uint32_t face_ = Tree::none;
};

}  // namespace hpccd
