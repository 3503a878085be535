// SPDX-License-Identifier: Apache-2.0
#include "traverse/far_pairs.h"

#include "base/simd/sets.h"

namespace hpccd {

// The functions of far_pairs.inl, compiled for each instruction set.
HPCCD_IN_EACH_SET(void far_pairs(const Tree&, const LeafRange&, const LeafRange&, TestedFeatures, float,
                                 CandidateBuffer&, CandidateBuffer&);)

LeafPairsInSnapshot far_pairs(Simd simd) { return HPCCD_OF_SET(simd, far_pairs); }

}  // namespace hpccd
