// SPDX-License-Identifier: Apache-2.0
// Four floats at a time (GCC/Clang vector extension). Every 64-bit processor supports them; usable everywhere except
// on a GPU.
#pragma once

#include <cstdint>
#include <cstring>
#if defined(__SSE2__)
#include <emmintrin.h>
#elif defined(__aarch64__)
#include <arm_neon.h>
#endif

namespace hpccd {

typedef float Floats4 __attribute__((vector_size(16)));
typedef std::int32_t Mask4 __attribute__((vector_size(16)));  // of a comparison: all bits of a lane, or none

// From any address, aligned or not.
[[gnu::always_inline]] inline Floats4 load4(const float* x) {
  Floats4 v;
  memcpy(&v, x, sizeof v);
  return v;
}

[[gnu::always_inline]] inline Floats4 min4(Floats4 a, Floats4 b) { return a < b ? a : b; }
[[gnu::always_inline]] inline Floats4 max4(Floats4 a, Floats4 b) { return a < b ? b : a; }

// Bit j: lane j.
[[gnu::always_inline]] inline unsigned bits4(Mask4 m) {
#if defined(__SSE2__)
  return static_cast<unsigned>(_mm_movemask_ps((__m128)m));
#elif defined(__aarch64__)
  return vaddvq_u32((uint32x4_t)(m & Mask4{1, 2, 4, 8}));
#else
  unsigned r = 0;
  for (int i = 0; i < 4; ++i) r |= (m[i] ? 1u : 0u) << i;
  return r;
#endif
}

[[gnu::always_inline]] inline bool any4(Mask4 m) {
#if defined(__aarch64__)
  return vmaxvq_u32((uint32x4_t)m) != 0;
#else
  return bits4(m) != 0;
#endif
}

}  // namespace hpccd
