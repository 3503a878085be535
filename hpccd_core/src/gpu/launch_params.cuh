// SPDX-License-Identifier: Apache-2.0
// What the kernels of one frame read and write. Passed by value: all pointers are to device memory.
#pragma once

#include <cstdint>

#include "base/hd.h"
#include "bvh/kdop.h"
#include "elementary/pair_vertices.h"
#include "gpu/counters.cuh"
#include "gpu/device_box.cuh"
#include "gpu/pair_keys.h"
#include "hpccd/hpccd.h"

namespace hpccd::gpu {

inline constexpr u32 all_lanes = 0xFFFFFFFFu;
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

struct alignas(16) DeviceLeaf {
  u32 first_face, first_edge, first_vertex;
  u32 counts;

  static u32 counts_of(u32 faces, u32 edges, u32 vertices) { return faces | edges << 8 | vertices << 16; }
  HPCCD_HD u32 n_faces() const { return counts & 0xFF; }
  HPCCD_HD u32 n_edges() const { return counts >> 8 & 0xFF; }
  HPCCD_HD u32 n_vertices() const { return counts >> 16; }
};

// Pairs of leaves, or of features of one kind. How many there are stands in the counters, which count on where the
// capacity is exceeded: so the host knows how much is needed.
struct PairList {
  uint2* pairs;
  u64 capacity;
};

template <class T>
struct LaunchParams {
  // The scene.
  u32 n_vertices, n_edges;
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

  // The tree: topology, and boxes of this frame.
  u32 n_nodes, n_leaves;
  DeviceBox* node_boxes;  // tags: left child (0: leaf), last leaf of the subtree
  const u32* node_mesh;
  const u32* node_parent;
  u32* node_arrivals;
  bool fits_edges;  // whether anybody looks at this frame's boxes of edges
  DeviceBox* leaf_boxes;
  const u32* leaf_nodes;
  const DeviceLeaf* leaves;
  const u32 *vertex_of_slot, *edge_of_slot, *face_of_slot;
  DeviceBox* edge_boxes;  // tags: the two vertices
  DeviceBox* face_boxes;  // tags: the first two corners
  const u32* face_corner2;

  // This frame's motion.
  const T *given_t0, *given_t1;
  double largest;  // coordinate that is acceptable
  GivenEnds<T>* vertices;
  DevicePoint* points;  // of the vertices

  // Of a frame all of whose pairs are of the tier of that name, and touch or do not.
  bool fast;
  VertexKdop* kdops;
  Kdop* leaf_kdops;
  bool in_floats;  // and which floats suffice for: the host's guess, before the counters say so

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
  u32* n_of_group;  // how many were found of each first feature: of vertices, then of edges; null: nobody asks
  u64* undecided;  // keys
  u64 undecided_capacity;
  u64* open_in_integers[integer_sizes];  // keys that need integers of one limb a coordinate, of two
  u64 open_capacity;                     // of each
  bool integers_on_device;               // else these go to the CPU as well
  u64* to_host;                          // keys that need the CPU's exact arithmetic
  u64 to_host_capacity;
  u32 segment, n_segments;  // leaf pairs of this pass: n * segment / n_segments ...
  Counters* counters;
};

__device__ inline u32 lane_number() { return threadIdx.x & 31; }

// A place for each lane with `wants`, by one atomic a warp. All lanes must call.
__device__ inline u64 warp_append(u64* counter, bool wants) {
  const u32 mask = __ballot_sync(all_lanes, wants);
  if (!mask) return 0;
  const u32 lane = lane_number(), leader = __ffs(mask) - 1;
  u64 base = 0;
  if (lane == leader) base = atomicAdd(counter, static_cast<u64>(__popc(mask)));
  base = __shfl_sync(all_lanes, base, leader);
  return base + __popc(mask & ((1u << lane) - 1));
}

// One vertex at both ends, widened.
struct Ends {
  Vec3<double> t0, t1;
};

__device__ inline Ends load_ends(const GivenEnds<float>* vertices, u32 v) {
  const float4 a = __ldg(&vertices[v].t0), b = __ldg(&vertices[v].t1);
  return {{a.x, a.y, a.z}, {b.x, b.y, b.z}};
}

__device__ inline Ends load_ends(const GivenEnds<double>* vertices, u32 v) {
  const double2 a = __ldg(&vertices[v].t0[0]), b = __ldg(&vertices[v].t0[1]), c = __ldg(&vertices[v].t1[0]),
                d = __ldg(&vertices[v].t1[1]);
  return {{a.x, a.y, b.x}, {c.x, c.y, d.x}};
}

// v as pair_vertices gives them.
template <Kind kind, class T>
__device__ inline Motion<double> load_motion(const GivenEnds<T>* vertices, uint4 v) {
  const Ends q0 = load_ends(vertices, v.x), q1 = load_ends(vertices, v.y), q2 = load_ends(vertices, v.z),
             q3 = load_ends(vertices, v.w);
  const Vec3<double> t0[4] = {q0.t0, q1.t0, q2.t0, q3.t0}, t1[4] = {q0.t1, q1.t1, q2.t1, q3.t1};
  return motion_of<kind>(t0, t1);
}

// One vertex at both ends, as floats in the coordinates of the boxes: what the CPU keeps as RoundedMotion.
struct RoundedEnds {
  Vec3<float> t0, t1;
};

__device__ inline RoundedEnds load_rounded_ends(const DevicePoint* points, u32 v) {
  const float4* at = reinterpret_cast<const float4*>(points + v);
  const float4 a = __ldg(at), b = __ldg(at + 1);
  return {{a.x, a.y, a.z}, {b.x, b.y, b.z}};
}

template <Kind kind>
__device__ inline Motion<float> load_rounded_motion(const DevicePoint* points, uint4 v) {
  const RoundedEnds q0 = load_rounded_ends(points, v.x), q1 = load_rounded_ends(points, v.y),
                    q2 = load_rounded_ends(points, v.z), q3 = load_rounded_ends(points, v.w);
  const Vec3<float> t0[4] = {q0.t0, q1.t0, q2.t0, q3.t0}, t1[4] = {q0.t1, q1.t1, q2.t1, q3.t1};
  return motion_of<kind>(t0, t1);
}

// Of an edge or of a face.
struct VertexNumbers {
  u32 v[3];
  __device__ u32 operator[](int i) const { return v[i]; }
};

template <Kind kind, class T>
__device__ inline uint4 vertices_of(const LaunchParams<T>& params, u32 first, u32 second) {
  // Through the cache for what no kernel writes.
  const auto edge = [&](u32 e) {
    const uint2 v = __ldg(params.edges + e);
    return VertexNumbers{{v.x, v.y}};
  };
  const auto face = [&](u32 i) {
    const u32* v = params.faces + 3 * static_cast<u64>(i);
    return VertexNumbers{{__ldg(v), __ldg(v + 1), __ldg(v + 2)}};
  };
  u32 v[4];
  pair_vertices<kind>(first, second, edge, face, v);
  return {v[0], v[1], v[2], v[3]};
}

template <class T>
__device__ inline Accuracy accuracy_of(const LaunchParams<T>& params, uint4 v) {
  if (!params.accuracy) return params.default_accuracy;
  // The second vertex belongs to the first edge or to the face, the third to the other edge or the face.
  return static_cast<Accuracy>(
      params.accuracy[params.mesh_of_vertex[v.x] * params.n_meshes + params.mesh_of_vertex[v.z]]);
}

// All features of a leaf are of one mesh.
template <class T>
__device__ inline u32 mesh_of_leaf(const LaunchParams<T>& params, u32 leaf) {
  const DeviceLeaf l = params.leaves[leaf];
  const u32 v = l.n_faces() > 0 ? params.faces[3 * static_cast<u64>(params.face_of_slot[l.first_face])]
                                : params.vertex_of_slot[l.first_vertex];
  return params.mesh_of_vertex[v];
}

// What is tested between two leaves.
template <class T>
__device__ inline u32 tested_features(const LaunchParams<T>& params, uint2 leaves) {
  if (!params.features) return params.default_features;
  return params.features[mesh_of_leaf(params, leaves.x) * params.n_meshes + mesh_of_leaf(params, leaves.y)];
}

template <class T>
__device__ inline Accuracy reported_as(const LaunchParams<T>& params, uint4 v) {
  const Accuracy accuracy = accuracy_of(params, v);
  return params.time_only && accuracy == Accuracy::exact ? Accuracy::conservative : accuracy;
}

// Of two features by one vertex of each.
template <class T>
__device__ inline double separation_of(const LaunchParams<T>& params, u32 first, u32 second) {
  if (!params.separations) return params.separation;
  return params.separations[params.mesh_of_vertex[first] * params.n_meshes + params.mesh_of_vertex[second]];
}

}  // namespace hpccd::gpu
