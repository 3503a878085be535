// SPDX-License-Identifier: Apache-2.0
// Inputs and outputs of the kernels of one frame. Passed by value: all pointers are to device memory.
#pragma once

#include <cstdint>

#include "base/hd.h"
#include "bvh/kdop.h"
#include "elementary/pair.h"
#include "gpu/counters.cuh"
#include "gpu/device_box.cuh"
#include "gpu/pair_keys.h"
#include "gpu/warp.cuh"
#include "hpccd/hpccd.h"

namespace hpccd::gpu {

inline constexpr u32 no_mesh = 0xFFFFFFFFu;
// Features are numbered in 31 bits, so that the kind of a pair fits beside them.
inline constexpr u32 kind_bit = 0x80000000u;

// Both ends of one vertex's motion as the caller gave them: half the bytes where they are floats, and widening is
// exact.
template <class T>
struct GivenEnds;
template <>
struct alignas(32) GivenEnds<float> {
  float4 t0, t1;
};
template <>
struct alignas(64) GivenEnds<double> {
  double2 t0[2], t1[2];
};

// What is tested between two meshes: a bit for each kind, by its number.
inline constexpr u32 tests_vertex_face = 1, tests_edge_edge = 2;

// Of a leaf, the same in all worlds. Its corners are its own vertices, then the others of its triangles: features name
// them by their place among these.
struct alignas(16) DeviceLeaf {
  u32 first_corner, first_edge, first_face;
  u32 counts;

  static u32 counts_of(u32 corners, u32 edges, u32 faces, u32 vertices) {
    return corners | edges << 8 | faces << 16 | vertices << 24;
  }
  HPCCD_HD u32 n_corners() const { return counts & 0xFF; }
  HPCCD_HD u32 n_edges() const { return counts >> 8 & 0xFF; }
  HPCCD_HD u32 n_faces() const { return counts >> 16 & 0xFF; }
  HPCCD_HD u32 n_vertices() const { return counts >> 24; }
};

// An edge or a face of a leaf: its number, and the places of its two or three corners, 8 bits each.
struct alignas(8) LeafFeature {
  u32 number, corners;
};

// Pairs of leaves, or of features of one kind. How many there are stands in the counters, which count on where the
// capacity is exceeded: so the host knows how much is needed.
struct PairList {
  uint2* pairs;
  u64 capacity;
};

// The quotient of numbers below 2^32 by one below 2^31: m = ceil(2^63 / d) is off by less than d, so n m / 2^63 by less
// than 1 / d.
struct Division {
  u64 magic;  // 0: every quotient is 0

  static Division by(u32 d) { return {((u64{1} << 63) + d - 1) / d}; }
  __device__ u32 operator()(u32 n) const { return static_cast<u32>(__umul64hi(magic, u64{n} << 1)); }
};

// Which of what is found are results, of each world.
enum class Wanted : unsigned char { all, earliest, first };

template <class T>
struct LaunchParams {
  // The scene, once for all its worlds. Vertices, edges and leaves are numbered through all of them, where they are of
  // a motion, or the first of a pair; of the scene itself, or the second of a pair, in one.
  u32 n_worlds;
  u32 n_vertices, n_edges;
  Division by_vertices, by_edges, by_nodes, by_leaves;  // to the world of a number; 0 where there is one world
  const uint2* edges;
  const u32* faces;  // three vertices each
  const u32* mesh_of_vertex;
  u32 n_meshes;
  const unsigned char* enabled;   // n_meshes^2; null: all pairs
  const unsigned char* accuracy;  // n_meshes^2; null: the default
  Accuracy default_accuracy;
  const unsigned char* features;  // n_meshes^2, tests_vertex_face and tests_edge_edge; null: the default
  unsigned char default_features;
  PairKeys keys;
  // How far apart features shall stay, or how near they are looked for.
  double separation;                 // where there is no table
  const double* separations;         // n_meshes^2
  const double* largest_separation;  // of each mesh, where there is a table

  // The tree: topology, and this frame's boxes of each world.
  u32 n_nodes, n_leaves;
  const uint2* node_links;  // left child (0: leaf), last leaf of the subtree
  const u32* node_mesh;
  const u32* node_parent;
  const u32* leaf_nodes;
  const DeviceLeaf* leaves;
  const u32* corners;  // vertices
  const LeafFeature *leaf_edges, *leaf_faces;
  DeviceBox* node_boxes;  // tags: the links
  u32* node_arrivals;
  DeviceBox* leaf_boxes;

  // This frame's motion.
  const T *given_t0, *given_t1;
  double largest;  // coordinate that is acceptable
  GivenEnds<T>* vertices;
  DevicePoint* points;  // of the vertices

  // Of a frame all of whose pairs are of the tier of that name, and touch or do not.
  bool fast;
  VertexKdop* kdops;
  Kdop* leaf_kdops;
  // Whether there are worlds for which floats suffice, and others: the host's guess, before the counters say so.
  bool in_floats, in_doubles;

  // Of a frame that looks for the earliest contacts (best_time.cuh).
  bool until_best;  // what touches after the best time so far does not matter
  bool time_only;   // the earliest time is all that is asked for: exact times are reported as conservative ones are
  double best;      // time so far, when the frame begins
  PairList hints[2];
  u64* n_hints;
  bool hints_decided;  // by the fallback, where the error bounds leave them open

  // Lists.
  PairList leaf_pairs, survivors[2], single[2], many[2], separated[2];
  u64* found_keys;
  double* found_tocs;
  u64 found_capacity;
  u32* n_of_group;  // how many were found of each first feature: of vertices, then of edges; null: not counted here
  Wanted wanted;
  u64* undecided;  // keys
  u64 undecided_capacity;
  u64* open_in_integers[integer_sizes];  // keys that need integers of one limb a coordinate, of two
  double* answers;                       // to those of the size at work (integer_stages.cu)
  u64 open_capacity;                     // of each
  bool integers_on_device;               // else these go to the CPU as well
  u64* to_host;                          // keys that need the CPU's exact arithmetic
  u64 to_host_capacity;
  u32 segment, n_segments;  // leaf pairs of this pass: n * segment / n_segments ...
  Counters* counters;
  WorldCounters* worlds;

  HPCCD_HD u32 all_vertices() const { return n_worlds * n_vertices; }
  HPCCD_HD u32 all_edges() const { return n_worlds * n_edges; }
  HPCCD_HD u32 all_leaves() const { return n_worlds * n_leaves; }
};

// Pairs by their first feature: vertices, then edges.
template <class T>
__device__ inline u32 group_of(const LaunchParams<T>& params, Kind kind, u32 first) {
  return kind == Kind::edge_edge ? params.all_vertices() + first : first;
}
template <class T>
__device__ inline u32 world_of(const LaunchParams<T>& params, Kind kind, u32 first) {
  return kind == Kind::edge_edge ? params.by_edges(first) : params.by_vertices(first);
}

// Of a pair of leaves: the first one is numbered through all worlds.
template <class T>
__device__ inline u32 world_of_leaves(const LaunchParams<T>& params, uint2 leaves) {
  return params.by_leaves(leaves.x);
}

// What is tested between two leaves, each with features of one mesh alone.
template <class T>
__device__ inline u32 tested_features(const LaunchParams<T>& params, const DeviceLeaf& a, const DeviceLeaf& b) {
  if (!params.features) return params.default_features;
  const auto mesh = [&](const DeviceLeaf& l) { return params.mesh_of_vertex[params.corners[l.first_corner]]; };
  return params.features[mesh(a) * params.n_meshes + mesh(b)];
}

}  // namespace hpccd::gpu
