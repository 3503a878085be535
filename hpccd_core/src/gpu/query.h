// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace hpccd::gpu {

// The query of a frame. Bounds, traversal, lists and results are the same for all; candidates and tests differ.
enum class Query : unsigned char {
  contacts,
  separations,    // contacts, and pairs within a separation above 0 that some meshes have
  proximity,      // of one snapshot: pairs within a distance
  intersections,  // of one snapshot: edges that intersect or touch faces
  nearest,        // of one snapshot: the nearest features of each pair of meshes
};

constexpr bool of_snapshot(Query q) {
  return q == Query::proximity || q == Query::intersections || q == Query::nearest;
}
// Whether boxes grow, so that boxes of features within a distance overlap.
constexpr bool grows_boxes(Query q) { return q == Query::separations || q == Query::proximity; }

}  // namespace hpccd::gpu
