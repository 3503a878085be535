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
#include "scene/features.h"
#include "scene/filter_view.h"

namespace hpccd::gpu {

inline constexpr u32 no_mesh = 0xFFFFFFFFu;
// Features are numbered in 31 bits, so that the kind of a pair fits into the same word.
inline constexpr u32 kind_bit = 0x80000000u;

// Both ends of one vertex's motion in the caller's precision: floats take half the bytes, and widening is exact.
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

// The tested kinds of two meshes: one bit for each kind, by its number.
inline constexpr u32 tests_vertex_face = 1, tests_edge_edge = 2;

// A leaf, the same in all worlds. Its corners are its own vertices, then the other vertices of its triangles; features
// refer to corners by their index.
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

// An edge or a face of a leaf: its number, and the indices of its two or three corners, 8 bits each.
struct alignas(8) LeafFeature {
  u32 number, corners;
};

// Pairs of leaves, or of features of one kind. The counters hold their number and continue counting beyond the
// capacity, so the host knows how much memory is needed.
struct PairList {
  uint2* pairs;
  u64 capacity;
};

// The quotient of numbers below 2^32 by a number below 2^31: m = ceil(2^63 / d) has an error below d, so n m / 2^63 one
// below 1 / d.
struct Division {
  u64 magic;  // 0: every quotient is 0

  static Division by(u32 d) { return {((u64{1} << 63) + d - 1) / d}; }
  __device__ u32 operator()(u32 n) const { return static_cast<u32>(__umul64hi(magic, u64{n} << 1)); }
};

// Which contacts are results, in each world.
enum class Wanted : unsigned char { all, earliest, first };

template <class T>
struct LaunchParams {
  // The scene, shared by all its worlds. Vertices, edges and leaves of motions, and the first one of a pair, are
  // numbered through all worlds; those of the scene itself, and the second one of a pair, within their world.
  u32 n_worlds;
  u32 n_vertices, n_edges;
  Division by_vertices, by_edges, by_nodes, by_leaves;  // from a number to its world; 0 for one world
  const uint2* edges;
  const u32* faces;  // three vertices each
  const u32* mesh_of_vertex;
  u32 n_meshes;
  const unsigned char* enabled;   // n_meshes^2; null: all pairs
  const unsigned char* accuracy;  // n_meshes^2; null: the default
  Accuracy default_accuracy;
  const unsigned char* features;  // n_meshes^2, tests_vertex_face and tests_edge_edge; null: the default
  unsigned char default_features;
  FilterView filter;              // in the numbers of one world
  const EdgeKind* edge_kinds;     // of edges; null if there are no points
  const unsigned char* filtered;  // n_meshes^2: whether some of their pairs are dropped; null: no pairs of meshes
  PairKeys keys;
  // The minimum separation, or the distance of a proximity query.
  double separation;                 // if there is no table
  const double* separations;         // n_meshes^2
  const double* largest_separation;  // of each mesh, if there is a table
  Thicknesses thickness;

  // The tree: topology, and the boxes of each world in this frame.
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

  // The motion of this frame.
  const T *given_t0, *given_t1;
  double largest;  // limit of valid coordinates
  GivenEnds<T>* vertices;
  DevicePoint* points;  // of the vertices

  // For frames in which all pairs have the tier `fast` and no separation.
  bool fast;
  VertexKdop* kdops;
  Kdop* leaf_kdops;
  // Whether there are worlds for which floats suffice, and worlds for which they do not: the host's guess, before the
  // counters are known.
  bool in_floats, in_doubles;

  // For frames that search for the earliest contacts (best_time.cuh).
  bool until_best;  // contacts after the best time so far do not matter
  bool time_only;   // only the earliest time is requested: exact times are reported as conservative ones
  double best;      // best time at the beginning of the frame
  PairList hints[2];
  u64* n_hints;
  bool hints_decided;  // by the fallback, if the error bounds leave them undecided

  // Lists.
  PairList leaf_pairs, survivors[2], single[2], many[2], separated[2];
  u64* found_keys;
  double* found_tocs;
  u64 found_capacity;
  u32* n_of_group;  // number of pairs by first feature: vertices, then edges; null: not counted here
  Wanted wanted;
  u64* undecided;  // keys
  u64 undecided_capacity;
  u64* open_in_integers[integer_sizes];  // keys that need integers of one limb per coordinate, of two
  double* answers;                       // for those of the current size (integer_stages.cu)
  u64 open_capacity;                     // of each
  bool integers_on_device;               // otherwise these go to the CPU as well
  u64* to_host;                          // keys that need the CPU's exact arithmetic
  u64 to_host_capacity;
  u32 segment, n_segments;  // leaf pairs of this pass: n * segment / n_segments ...
  Counters* counters;
  WorldCounters* worlds;

  HPCCD_HD u32 all_vertices() const { return n_worlds * n_vertices; }
  HPCCD_HD u32 all_edges() const { return n_worlds * n_edges; }
  HPCCD_HD u32 all_leaves() const { return n_worlds * n_leaves; }
};

// Groups of pairs by their first feature: vertices, then edges.
template <class T>
__device__ inline u32 group_of(const LaunchParams<T>& params, Kind kind, u32 first) {
  return kind == Kind::edge_edge ? params.all_vertices() + first : first;
}
template <class T>
__device__ inline u32 world_of(const LaunchParams<T>& params, Kind kind, u32 first) {
  return kind == Kind::edge_edge ? params.by_edges(first) : params.by_vertices(first);
}

// For a pair of leaves: the first one is numbered through all worlds.
template <class T>
__device__ inline u32 world_of_leaves(const LaunchParams<T>& params, uint2 leaves) {
  return params.by_leaves(leaves.x);
}

// The kinds tested between two leaves, each with features of one mesh only.
template <class T>
__device__ inline u32 tested_features(const LaunchParams<T>& params, const DeviceLeaf& a, const DeviceLeaf& b) {
  if (!params.features) return params.default_features;
  const auto mesh = [&](const DeviceLeaf& l) { return params.mesh_of_vertex[params.corners[l.first_corner]]; };
  return params.features[mesh(a) * params.n_meshes + mesh(b)];
}

// Whether some pairs of features of two leaves may be ignored or never tested.
template <class T>
__device__ inline bool are_filtered(const LaunchParams<T>& params, const DeviceLeaf& a, const DeviceLeaf& b) {
  const auto mesh = [&](const DeviceLeaf& l) { return params.mesh_of_vertex[params.corners[l.first_corner]]; };
  return params.filtered[mesh(a) * params.n_meshes + mesh(b)];
}

// Whether a pair is never tested because it has a point: edge and face, or two edges. The first feature is numbered
// through all worlds.
template <bool edge_and_face, class T>
__device__ inline bool is_never_tested(const LaunchParams<T>& params, uint2 pair, bool edges, u32 world) {
  if (!params.edge_kinds) return false;
  const auto kind = [&](u32 e) { return params.edge_kinds[e]; };
  if constexpr (edge_and_face) return kind(pair.x - world * params.n_edges) == EdgeKind::point;
  return edges && never_paired(kind(pair.x - world * params.n_edges), kind(pair.y));
}

// Whether a pair is ignored: edge and face, or two edges, or vertex and face. Numbers as above.
template <bool edge_and_face, class T>
__device__ inline bool is_ignored(const LaunchParams<T>& params, uint2 pair, bool edges, u32 world) {
  if constexpr (edge_and_face) return params.filter.edge_face(pair.x - world * params.n_edges, pair.y);
  return edges ? params.filter.edge_edge(pair.x - world * params.n_edges, pair.y)
               : params.filter.vertex_face(pair.x - world * params.n_vertices, pair.y);
}

}  // namespace hpccd::gpu
