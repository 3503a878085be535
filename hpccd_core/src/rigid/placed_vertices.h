// SPDX-License-Identifier: Apache-2.0
// The vertices of all links of a robot, each link at its pose.
#pragma once

#include <cstddef>
#include <span>

#include "rigid/pose.h"

namespace hpccd::rigid {

// One mesh: the vertices before `end`, from the end of the previous mesh on, move with the link `link`.
struct LinkMesh {
  std::size_t link, end;
};

// Throws InvalidArgument if a mesh's link has no pose, if ends are out of order, or if the number of vertices differs.
// placed: as many elements as vertices.
void place_vertices(std::span<const Pose> poses, std::span<const LinkMesh> meshes, std::span<const Vector> vertices,
                    std::span<Vector> placed);

}  // namespace hpccd::rigid
