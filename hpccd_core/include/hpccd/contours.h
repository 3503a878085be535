// SPDX-License-Identifier: Apache-2.0
// Intersection curves, and the parts of the meshes that they enclose.
#pragma once

#include <cstdint>
#include <vector>

#include "hpccd/export.h"
#include "hpccd/results.h"
#include "hpccd/scene.h"

namespace hpccd {
inline namespace v0_1 {

/// A polyline along which two meshes, or two parts of one mesh, intersect.
struct Contour {
  /// Rows of Intersections, in order along the curve. Neighbouring rows belong to one pair of triangles, or have the
  /// same point. A closed contour does not repeat its first row.
  std::vector<std::uint32_t> rows;
  bool closed = false;       ///< whether the last row and the first are neighbours too
  std::uint32_t mesh_a = 0;  ///< number of the first mesh
  std::uint32_t mesh_b = 0;  ///< number of the second mesh, >= mesh_a
};

/// The vertices on both sides that a contour encloses (Baraff, Witkin and Kass 2003), ascending.
struct EnclosedRegion {
  std::vector<std::uint32_t>
      vertices_a;  ///< of mesh_a; of the two parts into which the contour divides it, the smaller
  std::vector<std::uint32_t> vertices_b;  ///< of mesh_b
};

/// The intersection curves of one world, from the intersections of a detector with Options::points. Each row is in
/// exactly one contour. Where the meshes touch in a point, or overlap in a plane, a contour may be a single point. Of
/// three or more curves that meet in a point, one contains it. A contour begins with its smallest row if it is closed,
/// otherwise at the end with the smaller row, and the contours are sorted by their smallest rows. Throws
/// InvalidArgument if the intersections are not of this scene, or have no incidences.
HPCCD_API std::vector<Contour> contours(const Scene& scene, const Intersections& found);

/// The region enclosed by each contour, in their order. It is empty on a side on which the contour passes between the
/// vertices or does not divide the mesh, and for open contours, except those of one mesh that end in two vertices of
/// it: there both sides are one region. Throws as contours.
HPCCD_API std::vector<EnclosedRegion> enclosed_regions(const Scene& scene, const Intersections& found);

}  // namespace v0_1
}  // namespace hpccd
