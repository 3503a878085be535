// SPDX-License-Identifier: Apache-2.0
// Pairs of features as numbers whose order is the canonical one: kind, first feature, second feature.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>

#include "base/hd.h"
#include "elementary/pair.h"
#include "gpu/counters.cuh"

namespace hpccd::gpu {

struct PairKeys {
  u32 second_bits = 0, pair_bits = 0;  // of a key's second feature; of both features

  // For a scene with these numbers of features. An edge may be first and second, a vertex first, a face second. First
  // features are numbered through all worlds, second ones in their own.
  static PairKeys of(std::size_t n_vertices, std::size_t n_edges, std::size_t n_faces, std::size_t n_worlds) {
    const auto bits = [](std::size_t n) { return static_cast<u32>(std::bit_width(std::max<std::size_t>(n, 1) - 1)); };
    const u32 first = std::max<u32>(1, std::max(bits(n_vertices * n_worlds), bits(n_edges * n_worlds))),
              second = std::max<u32>(1, std::max(bits(n_faces), bits(n_edges)));
    return {second, first + second};
  }

  u32 bits() const { return pair_bits + 1; }  // of the largest key

  HPCCD_HD u64 key_of(Kind kind, u32 first, u32 second) const {
    return (static_cast<u64>(kind == Kind::edge_edge) << pair_bits) | (static_cast<u64>(first) << second_bits) | second;
  }
  HPCCD_HD Candidate pair_of(u64 key) const {
    const u64 features = key & ((u64{1} << pair_bits) - 1);
    return {static_cast<u32>(features >> second_bits), static_cast<u32>(features & ((u64{1} << second_bits) - 1)),
            key >> pair_bits ? Kind::edge_edge : Kind::vertex_face};
  }
};

}  // namespace hpccd::gpu
