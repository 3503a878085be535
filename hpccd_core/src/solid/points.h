// SPDX-License-Identifier: Apache-2.0
// Queries of many points and one closed mesh. Points are processed along a space-filling curve, so that neighbours read
// the same nodes and faces, and each begins with what the one before has found.
#pragma once

#include <vector>

#include "base/parallel.h"
#include "solid/mesh_in_tree.h"

namespace hpccd {

// Throws InvalidArgument for a coordinate that is not finite or beyond largest_in_snapshot.
std::vector<Vec3<double>> checked_points(Positions points, ThreadPool& pool);

// Throw InvalidArgument for a coordinate that is not finite or beyond largest_in_snapshot, and Cancelled.
WindingNumbers winding_numbers(const MeshInTree& mesh, Positions points, ThreadPool& pool);
SignedDistances signed_distances(const MeshInTree& mesh, Positions points, ThreadPool& pool);

}  // namespace hpccd
