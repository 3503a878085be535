// SPDX-License-Identifier: Apache-2.0
// Links edge-face intersections to curves, and finds what these enclose.
#pragma once

#include <span>

#include "hpccd/contours.h"

namespace hpccd {

// Rows of one world, as in Intersections.
struct IntersectionRows {
  std::span<const std::array<std::uint32_t, 3>> ef;
  std::span<const std::uint8_t> incidences;
  std::span<const std::array<std::uint32_t, 3>> faces;
  std::span<const std::int64_t> first_vertex;  // of each mesh, and the number of all vertices
};

// As the functions of hpccd/contours.h.
std::vector<Contour> contours_of(const IntersectionRows& rows);
std::vector<EnclosedRegion> enclosed_regions_of(const IntersectionRows& rows);

}  // namespace hpccd
