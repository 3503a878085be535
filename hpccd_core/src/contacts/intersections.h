// SPDX-License-Identifier: Apache-2.0
// Converts the intersecting edges and faces that the threads found into the public result: canonical order and hash,
// and where they meet.
#pragma once

#include <functional>

#include "base/parallel.h"
#include "contacts/order.h"
#include "scene/face_adjacency.h"
#include "scene/features.h"

namespace hpccd {

Intersections collect_intersections(std::vector<Worker>& workers, const Geometry& geometry, ContactOrder& order,
                                    ThreadPool& pool);

// A position by the number of its vertex, of one world.
using PositionOf = std::function<Vec3<double>(std::uint32_t)>;

// Writes points, edge parameters, weights and incidences of all rows, of one world or of many, with positions on the
// host; and directions if adjacency is not null.
void add_places(Intersections& found, const Features& features, Positions vertices, const FaceAdjacency* adjacency,
                ThreadPool& pool);
// The same for one world.
void add_places(Intersections& found, const Features& features, const PositionOf& position_of,
                const FaceAdjacency* adjacency, ThreadPool& pool);

}  // namespace hpccd
