// SPDX-License-Identifier: Apache-2.0
#include "traverse/leaf_edge_faces.h"

namespace hpccd {

// Of leaf_edge_faces.inl, compiled for each instruction set.
namespace scalar {
void leaf_edge_faces(const Tree&, const LeafRange&, const LeafRange&, CandidateBuffer&);
}
#if defined(HPCCD_X86)
namespace avx2 {
void leaf_edge_faces(const Tree&, const LeafRange&, const LeafRange&, CandidateBuffer&);
}
namespace avx512 {
void leaf_edge_faces(const Tree&, const LeafRange&, const LeafRange&, CandidateBuffer&);
}
#endif

LeafEdgeFaces leaf_edge_faces([[maybe_unused]] Simd simd) {
#if defined(HPCCD_X86)
  if (simd == Simd::avx512) return avx512::leaf_edge_faces;
  if (simd == Simd::avx2) return avx2::leaf_edge_faces;
#endif
  return scalar::leaf_edge_faces;
}

}  // namespace hpccd
