// SPDX-License-Identifier: Apache-2.0
// The vertices of all links of a robot, each link at its pose.
#pragma once

#include <cstddef>
#include <span>

#include "rigid/pose.h"

namespace hpccd::rigid {

// One mesh: the vertices before `end` and from the end of the mesh before it on go with the link `link`.
struct LinkMesh {
  std::size_t link, end;
};

// Throws InvalidArgument: a mesh of a link that has no pose, ends out of order, or another number of vertices. placed:
// as many as vertices.
void place_vertices(std::span<const Pose> poses, std::span<const LinkMesh> meshes, std::span<const Vector> vertices,
                    std::span<Vector> placed);

}  // namespace hpccd::rigid
