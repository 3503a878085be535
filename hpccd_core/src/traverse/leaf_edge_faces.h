// SPDX-License-Identifier: Apache-2.0
// Candidates for intersections in the snapshot at t = 0: edges and faces of two leaves whose boxes overlap then and
// that share no vertex.
#pragma once

#include "traverse/leaf_pairs.h"

namespace hpccd {

// Appends edges of each leaf paired with faces of the other to `edge_face`, edge first. a == b: pairs within one leaf.
using LeafEdgeFaces = void (*)(const Tree& tree, const LeafRange& a, const LeafRange& b, CandidateBuffer& edge_face);

LeafEdgeFaces leaf_edge_faces(Simd simd);

}  // namespace hpccd
