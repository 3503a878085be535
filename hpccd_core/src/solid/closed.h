// SPDX-License-Identifier: Apache-2.0
// Closed meshes and connected components: properties of the topology.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/cancellation.h"
#include "scene/features.h"

namespace hpccd {

// A mesh is closed if each edge of its faces is in exactly two of them, in opposite directions. Returns an edge for
// which that does not hold, the first in lexicographic order, with the lower vertex first. A face that names a vertex
// twice is an edge and does not count.
std::optional<std::array<std::uint32_t, 2>> open_edge(std::span<const std::array<std::uint32_t, 3>> faces,
                                                      const Cancellation& cancellation = never_cancelled);

// Whether it is closed and has a face with three vertices.
bool is_closed(std::span<const std::array<std::uint32_t, 3>> faces, const Cancellation& cancellation = never_cancelled);

// For each vertex of the scene, the lowest vertex that is connected with it by edges.
std::vector<std::uint32_t> connected_components(const Features& features, const Cancellation& cancellation);

}  // namespace hpccd
