// SPDX-License-Identifier: Apache-2.0
// Whether two meshes are free of each other after a translation, and how deep vertices of one are in the other.
#pragma once

#include "solid/moved_pair.h"

namespace hpccd {

// Whether no face of mesh a, its vertices moved by the translation and rounded to doubles, has a point in common with a
// face of mesh b, and no part of either is inside the other one if that is closed. Exact for these numbers. The
// translation is in units of the scene.
bool is_free(const MovedPair& pair, const Vec3<double>& translation);

// The largest distance of a vertex of either mesh that is inside the closed other one from the latter's surface, or
// slightly less; 0 without such a vertex. In units of the scene.
double deepest_vertex(const MovedPair& pair);

}  // namespace hpccd
