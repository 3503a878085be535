// SPDX-License-Identifier: Apache-2.0
// The interface of kernels, implemented for every machine. Kernels (*.inl) are compiled once for each instruction set,
// after its header: avx2.h, avx512.h and neon.h define the same names, and results are bit-identical. Everything is
// inlined: a function compiled for one set must not be linked into code for another.
#pragma once

#include <bit>

#include "base/simd/four.h"
#include "base/simd/lanes_128.h"
#include "base/simd/numbers.h"
#include "base/vec3.h"

#define HPCCD_ISA scalar

namespace hpccd::scalar {

// Bit j of the result: lane j of sixteen.
HPCCD_HD unsigned bits16(const Mask4 (&of)[4]) {
  return bits4(of[0]) | bits4(of[1]) << 4 | bits4(of[2]) << 8 | bits4(of[3]) << 12;
}

#include "base/simd/set_128.inl"

// Sixteen bytes, as two words: bytes are picked one by one, and a register that is read as a whole after its parts were
// written stalls.
struct Bytes16 {
  static_assert(std::endian::native == std::endian::little);  // byte j of a number is byte j in memory
  std::uint64_t half[2];
};
HPCCD_HD Bytes16 load_bytes(const std::uint8_t* x) {
  Bytes16 r;
  __builtin_memcpy(&r, x, sizeof r);
  return r;
}
HPCCD_HD Bytes16 operator&(const Bytes16& a, const Bytes16& b) {
  return {{a.half[0] & b.half[0], a.half[1] & b.half[1]}};
}
HPCCD_HD Bytes16 operator|(const Bytes16& a, const Bytes16& b) {
  return {{a.half[0] | b.half[0], a.half[1] | b.half[1]}};
}
// Bit i of byte j: lane j of mask i.
HPCCD_HD Bytes16 to_bytes(const SideBits (&of)[4]) {
  Bytes16 r;
#if defined(__SSE2__)
  const __m128i low = _mm_packs_epi32((__m128i)of[0].v, (__m128i)of[1].v),
                high = _mm_packs_epi32((__m128i)of[2].v, (__m128i)of[3].v);
  const __m128i bytes = _mm_packus_epi16(low, high);
  __builtin_memcpy(&r, &bytes, sizeof r);
#else
  for (int j = 0; j < 16; ++j) {
    const auto byte = static_cast<std::uint64_t>(of[j / 4].v[j % 4]) << (8 * (j % 8));
    r.half[j / 8] = j % 8 == 0 ? byte : r.half[j / 8] | byte;
  }
#endif
  return r;
}
// Byte j: byte number which[j], out of 16 or of 32.
HPCCD_HD Bytes16 picked_from(const std::uint8_t* of, const Bytes16& which) {
  Bytes16 r;
  for (int i = 0; i < 2; ++i) {
    std::uint64_t bytes = 0;
    for (int j = 0; j < 64; j += 8) bytes |= std::uint64_t{of[which.half[i] >> j & 0xFF]} << j;
    r.half[i] = bytes;
  }
  return r;
}
HPCCD_HD Bytes16 picked(const Bytes16& bytes, const Bytes16& which) {
  return picked_from(reinterpret_cast<const std::uint8_t*>(&bytes), which);
}
HPCCD_HD Bytes16 picked(const Bytes16& bytes, const Bytes16& next, const Bytes16& which) {
  const Bytes16 both[2] = {bytes, next};
  return picked_from(reinterpret_cast<const std::uint8_t*>(both), which);
}
// Bit j: byte j is zero.
HPCCD_HD unsigned zeros(const Bytes16& x) {
  unsigned bits = 0;
  for (int i = 0; i < 2; ++i) {
    constexpr std::uint64_t low = 0x7F7F7F7F7F7F7F7Full;
    const std::uint64_t zero = ~(((x.half[i] & low) + low) | x.half[i] | low) >> 7;  // one in each such byte
    bits |= static_cast<unsigned>(zero * 0x0102040810204080ull >> 56) << (8 * i);
  }
  return bits;
}

// Bit j: number j of sixteen equals x.
HPCCD_HD unsigned equal16(const std::uint32_t* numbers, std::uint32_t x) {
  unsigned bits = 0;
  for (unsigned j = 0; j < 16; ++j) bits |= static_cast<unsigned>(numbers[j] == x) << j;
  return bits;
}

}  // namespace hpccd::scalar
