// SPDX-License-Identifier: Apache-2.0
// The interface of kernels (scalar.h), implemented with NEON. Arithmetic uses the compiler's vectors, which every
// aarch64 supports. This file contains what these compute element by element and NEON computes at once.
#pragma once

#include <arm_neon.h>

#include "base/simd/four.h"
#include "base/simd/lanes_128.h"
#include "base/simd/numbers.h"
#include "base/vec3.h"

#define HPCCD_ISA neon

namespace hpccd::neon {

// The low bytes of four times four numbers.
HPCCD_HD uint8x16_t low_bytes(const Mask4 (&of)[4]) {
  const uint16x8_t low = vuzp1q_u16((uint16x8_t)of[0], (uint16x8_t)of[1]),
                   high = vuzp1q_u16((uint16x8_t)of[2], (uint16x8_t)of[3]);
  return vuzp1q_u8((uint8x16_t)low, (uint8x16_t)high);
}
// Bit j: byte j, whose bits are all set or all clear.
HPCCD_HD unsigned bits_of_bytes(uint8x16_t m) {
  const uint8x16_t own = (uint8x16_t)vdupq_n_u64(0x8040201008040201u);
  uint8x16_t sums = vandq_u8(m, own);
  for (int i = 0; i < 3; ++i) sums = vpaddq_u8(sums, sums);
  return vgetq_lane_u16((uint16x8_t)sums, 0);
}
// Bit j of the result: lane j of sixteen.
HPCCD_HD unsigned bits16(const Mask4 (&of)[4]) { return bits_of_bytes(low_bytes(of)); }

#include "base/simd/set_128.inl"

struct Bytes16 {
  uint8x16_t v;
};
HPCCD_HD Bytes16 load_bytes(const std::uint8_t* x) { return {vld1q_u8(x)}; }
HPCCD_HD Bytes16 operator&(Bytes16 a, Bytes16 b) { return {vandq_u8(a.v, b.v)}; }
HPCCD_HD Bytes16 operator|(Bytes16 a, Bytes16 b) { return {vorrq_u8(a.v, b.v)}; }
HPCCD_HD Bytes16 to_bytes(const SideBits (&of)[4]) { return {low_bytes({of[0].v, of[1].v, of[2].v, of[3].v})}; }
HPCCD_HD Bytes16 picked(Bytes16 bytes, Bytes16 which) { return {vqtbl1q_u8(bytes.v, which.v)}; }
HPCCD_HD Bytes16 picked(Bytes16 bytes, Bytes16 next, Bytes16 which) {
  return {vqtbl2q_u8({{bytes.v, next.v}}, which.v)};
}
HPCCD_HD unsigned zeros(Bytes16 x) { return bits_of_bytes(vceqzq_u8(x.v)); }

HPCCD_HD unsigned equal16(const std::uint32_t* numbers, std::uint32_t x) {
  const uint32x4_t all = vdupq_n_u32(x);
  const auto equal = [&](int i) { return (Mask4)vceqq_u32(vld1q_u32(numbers + 4 * i), all); };
  return bits16({equal(0), equal(1), equal(2), equal(3)});
}

}  // namespace hpccd::neon
