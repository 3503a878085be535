// SPDX-License-Identifier: Apache-2.0
// The hash of a set of contacts: a sum over contacts, independent of their order, so that threads and devices can each
// add their part.
#pragma once

#include <cstdint>
#include <cstring>

#include "base/hd.h"
#include "elementary/motion.h"

namespace hpccd {

// Finaliser of MurmurHash3 (public domain constants): every input bit affects every output bit.
HPCCD_HD std::uint64_t mix(std::uint64_t x) {
  x ^= x >> 33, x *= 0xff51afd7ed558ccdULL;
  x ^= x >> 33, x *= 0xc4ceb9fe1a85ec53ULL;
  return x ^ (x >> 33);
}

HPCCD_HD std::uint64_t bits_of(double x) {
  std::uint64_t b;
  memcpy(&b, &x, sizeof b);
  return b;
}

HPCCD_HD std::uint64_t salt_of(Kind kind) {
  return kind == Kind::edge_edge ? 0x9e3779b97f4a7c15ULL : kind == Kind::vertex_face ? 1 : 0xd1b54a32d192ed03ULL;
}

// a, b: vertex and face, both edges, or edge and face. An edge is given as first vertex << 32 | second vertex.
HPCCD_HD std::uint64_t hash_of(Kind kind, std::uint64_t a, std::uint64_t b, double toc) {
  return mix(mix(mix(a + salt_of(kind)) ^ b) ^ bits_of(toc));
}

HPCCD_HD std::uint64_t hash_of_vertex_plane(std::uint32_t vertex, std::uint32_t plane, double toc) {
  return mix(mix(mix(vertex + 0xa24baed4963ee407ULL) ^ plane) ^ bits_of(toc));
}

// The weight of a world's hash in the total hash: the same contacts in another world give another hash.
HPCCD_HD std::uint64_t hash_weight(std::uint64_t world) { return 2 * world + 1; }

HPCCD_HD std::uint64_t pack(std::uint32_t high, std::uint32_t low) { return (std::uint64_t{high} << 32) | low; }

}  // namespace hpccd
