// SPDX-License-Identifier: Apache-2.0
// The state of a search for the nearest features of pairs of meshes on the device.
#pragma once

#include "gpu/bounds.cuh"
#include "gpu/nearest.h"
#include "gpu/traverse.cuh"

namespace hpccd::gpu {

inline constexpr u64 no_pair = ~u64{0};
inline constexpr u32 no_node = 0xFFFFFFFFu;

// Two meshes, the same in all worlds.
struct SearchedMeshes {
  u32 root_a, root_b;          // no_node: a mesh without features
  u32 first_leaf, n_leaves;    // of the first mesh
  bool same;                   // pairs within one mesh
  bool bounded;                // any two vertices of features bound the distance
  double thickest, most_lack;  // NearestPairs::lack
};

// What is in a subtree.
struct NodeContent {
  static constexpr u32 faces = 1, edges = 2, isolated_vertices = 4;
  u32 least_edge, kinds;  // the lowest number of an edge; which kinds of features

  // Whether some features of two nodes are tested against each other.
  HPCCD_HD static bool tested(u32 a, u32 b) { return ((a | b) & faces) || (a & b & edges); }
};

// Leaves whose own features bound the distances within a mesh, if nothing else does.
inline constexpr u32 samples_of_mesh = 64;

// The nearest pair so far of two meshes in one world.
struct NearestSoFar {
  u64 limit;         // bits: pairs beyond it, plus their lack, cannot improve the result
  u64 distance;      // bits, with the lack
  u64 key;           // kind, first, second: its order is that of NearestPair::before at equal distances
  u64 intersecting;  // edge << 32 | face: the first intersecting pair; then distances do not matter
  double without_thickness;
  double scale, sums, rounding;  // of the world's coordinates
  u32 lock;
};

struct NearestCounters {
  u64 nodes[traverse_depth + 2];  // by level
  u64 leaves, samples, undecided, tests;
};

struct NearestTask {
  u32 n_pairs, n_all;  // of meshes; in all worlds
  const SearchedMeshes* meshes;
  const NodeContent *contents, *leaf_contents;  // of nodes, of leaves
  NearestSoFar* so_far;
  uint4* nodes[2];  // a, b, number of the pair of meshes
  uint4* leaves;    // the same
  uint4* samples;
  uint4* undecided;  // number, kind, first, second
  u64 node_capacity, leaf_capacity, sample_capacity, undecided_capacity;
  NearestCounters* counters;
  Thicknesses thickness;
  NearestOfMeshes* results;
  UndecidedNearest* undecided_results;
};

// A vertex whose winding number with respect to a mesh is asked.
struct VertexAndMesh {
  u32 world, vertex, root;
};

struct InsideTask {
  u32 n;
  const VertexAndMesh* asked;
  std::int32_t* numbers;
};

__device__ inline double double_of(u64 bits) { return __longlong_as_double(static_cast<long long>(bits)); }

// Read as other multiprocessors have written it.
__device__ inline u64 fresh(const u64* at) { return *reinterpret_cast<const volatile u64*>(at); }
__device__ inline double limit_of(const NearestSoFar& s) { return double_of(fresh(&s.limit)); }

// Features farther apart than this along an axis, in coordinates of the boxes, cannot improve the result.
__device__ inline float reach_of(const NearestSoFar& s, double limit) {
  if (!(limit < 1e307)) return INFINITY;
  return static_cast<float>(fmin((limit + s.sums) * s.scale * (1 + 1e-6) + 1e-6, 1e30));
}

__device__ inline void lower_limit(NearestSoFar& s, double limit) {
  const u64 bits = bits_of(limit);
  if (bits < fresh(&s.limit)) atomicMin(&s.limit, bits);
}

// From an upper bound in coordinates of the boxes, of any two vertices (near_corners.h). Each coordinate has a rounding
// error of 2.4e-7 for two of them.
__device__ inline void lower_limit_by_box(NearestSoFar& s, double most_lack, float square) {
  const double distance = (double{sqrtf(square)} * (1 + 1e-6) + 1e-6) / s.scale + most_lack;
  lower_limit(s, distance * (1 + 1e-14) + 2 * s.rounding);
}

__device__ inline u64 key_of_nearest(Kind kind, u32 first, u32 second) {
  return static_cast<u64>(kind == Kind::edge_edge) << 62 | static_cast<u64>(first) << 31 | second;
}

// Takes the better pair. One thread at a time.
__device__ inline void offer_locked(NearestSoFar& s, double distance, u64 key, double without_thickness) {
  const u64 bits = bits_of(distance);
  const auto better = [&] {
    // Written in the opposite order: a distance that is read comes with its key, or with that of a better pair.
    const u64 now = fresh(&s.distance);
    __threadfence();
    return bits < now || (bits == now && key < fresh(&s.key));
  };
  for (bool done = !better(); !done;) {
    if (atomicCAS(&s.lock, 0u, 1u) == 0) {
      __threadfence();
      if (better()) {
        *reinterpret_cast<volatile double*>(&s.without_thickness) = without_thickness;
        *reinterpret_cast<volatile u64*>(&s.key) = key;
        __threadfence();
        *reinterpret_cast<volatile u64*>(&s.distance) = bits;
        __threadfence();
        lower_limit(s, distance * (1 + 1e-14) + s.rounding);
      }
      __threadfence();
      atomicExch(&s.lock, 0u);
      done = true;
    } else {
      done = !better();
    }
  }
}

}  // namespace hpccd::gpu
