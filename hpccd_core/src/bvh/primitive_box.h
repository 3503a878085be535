// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "scene/features.h"

namespace hpccd {

// The box of a primitive from those of its vertices: of the whole sweep (box.h) or at both ends of the motion
// (motion_box.h).
template <class AnyBox>
AnyBox primitive_box(const Features& features, const std::vector<AnyBox>& vertex_boxes, std::uint32_t c) {
  if (c >= features.first_lone_vertex()) return vertex_boxes[features.lone_vertices[c - features.first_lone_vertex()]];
  if (c >= features.first_lone_edge()) {
    const auto& ends = features.lone_edges[c - features.first_lone_edge()];
    AnyBox b = vertex_boxes[ends[0]];
    b.include(vertex_boxes[ends[1]]);
    return b;
  }
  const auto& corners = features.faces[c];
  AnyBox b = vertex_boxes[corners[0]];
  b.include(vertex_boxes[corners[1]]);
  b.include(vertex_boxes[corners[2]]);
  return b;
}

}  // namespace hpccd
