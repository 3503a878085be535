// SPDX-License-Identifier: Apache-2.0
// Whether two meshes are free of each other after a translation, and how deep vertices of one are in the other.
#pragma once

#include "solid/moved_pair.h"

namespace hpccd {

// Whether no face of mesh a, its vertices moved by the translation and rounded to doubles, has a point in common with a
// face of mesh b, and no part of either is inside the other one if that is closed. Exact for these numbers. The
// translation is in units of the scene.
bool is_free(const MovedPair& pair, const Vec3<double>& translation);

// The vertex of either mesh that is inside the closed other one and farthest from the latter's surface.
struct DeepestVertex {
  double depth = 0;        // in units of the scene, or slightly less; 0 without such a vertex
  Vec3<double> way_out{};  // of mesh a, so that the vertex and the nearest point of the surface meet: a direction
};
DeepestVertex deepest_vertex(const MovedPair& pair);

// For each curve in which the two surfaces intersect, the normal of the area that it encloses, as long as the area; the
// largest first, and at most `most`. Of open curves, of which there may be parts in one, as long as it is. In rounded
// arithmetic: directions to begin a search with.
std::vector<Vec3<double>> normals_of_contours(const MovedPair& pair, std::size_t most);

}  // namespace hpccd
