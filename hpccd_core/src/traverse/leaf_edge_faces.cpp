// SPDX-License-Identifier: Apache-2.0
#include "traverse/leaf_edge_faces.h"

#include "base/simd/sets.h"

namespace hpccd {

// The functions of leaf_edge_faces.inl, compiled for each instruction set.
HPCCD_IN_EACH_SET(void leaf_edge_faces(const Tree&, const LeafRange&, const LeafRange&, CandidateBuffer&);)

LeafEdgeFaces leaf_edge_faces(Simd simd) { return HPCCD_OF_SET(simd, leaf_edge_faces); }

}  // namespace hpccd
