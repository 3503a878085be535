// SPDX-License-Identifier: Apache-2.0
// Masks of lanes in 16-byte registers. Instruction sets with such registers share these lane types and all
// instantiations with them, so the code must be the same in all of them.
#pragma once

#include "base/simd/four.h"
#include "base/simd/lanes.h"

namespace hpccd {

HPCCD_HD unsigned bits(LaneMask<float, 4> m) { return bits4((Mask4)m.v); }
HPCCD_HD unsigned bits(LaneMask<double, 2> m) {
#if defined(__SSE2__)
  return static_cast<unsigned>(_mm_movemask_pd((__m128d)m.v));
#else
  return (m.v[0] ? 1u : 0u) | (m.v[1] ? 2u : 0u);
#endif
}

}  // namespace hpccd
