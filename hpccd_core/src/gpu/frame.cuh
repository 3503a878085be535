// SPDX-License-Identifier: Apache-2.0
// What the kernels of one frame read and write. Passed by value: all pointers are to device memory.
#pragma once

#include <cstdint>

#include "elementary/motion.h"
#include "hpccd/hpccd.h"

namespace hpccd::gpu {

using u32 = std::uint32_t;
using u64 = unsigned long long;

inline constexpr u32 all_lanes = 0xFFFFFFFFu;
inline constexpr u32 no_mesh = 0xFFFFFFFFu;
// Features are numbered in 31 bits, so that the kind of a pair fits beside them.
inline constexpr u32 kind_bit = 0x80000000u;

// Both ends of one vertex's motion as the caller gave them: half the bytes where they are floats, and widening is exact.
template <class T>
struct Row;
template <>
struct alignas(32) Row<float> {
  float4 t0, t1;
};
template <>
struct alignas(64) Row<double> {
  double2 t0[2], t1[2];
};

// Two 16-byte words that are loaded together; what `tag` holds depends on the list.
struct alignas(32) DeviceBox {
  float low[3];
  u32 tag_low;
  float high[3];
  u32 tag_high;
};

struct alignas(16) DeviceLeaf {
  u32 first_face, first_edge, first_vertex;
  u32 counts;  // faces | edges << 8 | vertices << 16
};

// Pairs of features of one kind; n counts on where `capacity` is exceeded, so that the host knows how much is needed.
struct PairList {
  uint2* pairs;
  u64 capacity;
};

struct Counters {
  u64 extent_low[3], extent_high[3];  // largest of the ordered bits, low ones negated: zero is neutral
  u64 bad;                            // coordinates that are not acceptable
  u64 node_tests;
  u64 leaf_pairs, next_leaf_pair;
  u64 survivors[2], single[2], many[2];                        // of the segment at work
  u64 all_survivors[2], all_single[2], all_many[2], most_survivors, most_single, most_many;  // of all segments
  u64 candidates[2], proven[2], undecided_of[2];
  u64 found[2];                       // by kind, after the last resort on the device
  u64 found_all, undecided, to_host;
  u64 hash;
  double area;
};

template <class T>
struct Frame {
  // The scene.
  u32 n_vertices, n_edges, n_faces;
  const uint2* edges;
  const u32* faces;            // three vertices each
  const u32* mesh_of_vertex;
  u32 n_meshes;
  const unsigned char* enabled;   // n_meshes^2; null: all pairs
  const unsigned char* accuracy;  // n_meshes^2; null: the default
  Accuracy default_accuracy;
  u32 key_shift;               // bits of a key's second feature
  u32 kind_shift;              // bits of both features

  // The tree: topology, and boxes of this frame.
  u32 n_nodes, n_leaves;
  DeviceBox* node_boxes;       // tags: left child (0: leaf), last leaf of the subtree
  const u32* node_mesh;
  const u32* node_parent;
  u32* node_arrivals;
  DeviceBox* leaf_boxes;
  const u32* leaf_nodes;
  const DeviceLeaf* leaves;
  const u32 *vertex_of_slot, *edge_of_slot, *face_of_slot;
  DeviceBox* edge_boxes;       // tags: the two vertices
  DeviceBox* face_boxes;       // tags: the first two corners
  const u32* face_corner2;

  // This frame's motion.
  const T *given_t0, *given_t1;
  Row<T>* rows;
  DeviceBox* vertex_boxes;

  // Lists.
  PairList leaf_pairs, survivors[2], single[2], many[2];
  u64* found_keys;
  double* found_tocs;
  u64 found_capacity;
  u64* undecided;              // keys
  u64 undecided_capacity;
  u64* to_host;                // keys that need exact arithmetic
  u64 to_host_capacity;
  u32 segment, n_segments;     // leaf pairs of this pass: n * segment / n_segments ...
  Counters* counters;
};

__device__ inline u64 key_of(u32 key_shift, u32 kind_shift, Kind kind, u32 first, u32 second) {
  return (static_cast<u64>(kind == Kind::edge_edge) << kind_shift) | (static_cast<u64>(first) << key_shift) | second;
}

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

__device__ inline DeviceBox load_box(const DeviceBox* b) {
  const float4 low = reinterpret_cast<const float4*>(b)[0], high = reinterpret_cast<const float4*>(b)[1];
  return {{low.x, low.y, low.z}, __float_as_uint(low.w), {high.x, high.y, high.z}, __float_as_uint(high.w)};
}

// Past this multiprocessor's own cache: written by another one in the same kernel.
__device__ inline DeviceBox load_box_fresh(const DeviceBox* b) {
  const float4 low = __ldcg(reinterpret_cast<const float4*>(b)), high = __ldcg(reinterpret_cast<const float4*>(b) + 1);
  return {{low.x, low.y, low.z}, __float_as_uint(low.w), {high.x, high.y, high.z}, __float_as_uint(high.w)};
}

__device__ inline void store_box(DeviceBox* to, const DeviceBox& b) {
  reinterpret_cast<float4*>(to)[0] = {b.low[0], b.low[1], b.low[2], __uint_as_float(b.tag_low)};
  reinterpret_cast<float4*>(to)[1] = {b.high[0], b.high[1], b.high[2], __uint_as_float(b.tag_high)};
}

__device__ inline void include(DeviceBox& a, const DeviceBox& b) {
  for (int k = 0; k < 3; ++k) {
    a.low[k] = b.low[k] < a.low[k] ? b.low[k] : a.low[k];
    a.high[k] = a.high[k] < b.high[k] ? b.high[k] : a.high[k];
  }
}

__device__ inline bool overlap(const DeviceBox& a, const DeviceBox& b) {
  return (a.low[0] <= b.high[0]) & (b.low[0] <= a.high[0]) & (a.low[1] <= b.high[1]) & (b.low[1] <= a.high[1]) &
         (a.low[2] <= b.high[2]) & (b.low[2] <= a.high[2]);
}

// One vertex at both ends, widened.
struct Ends {
  Vec3<double> t0, t1;
};

__device__ inline Ends load_row(const Row<float>* rows, u32 v) {
  const float4 a = __ldg(&rows[v].t0), b = __ldg(&rows[v].t1);
  return {{a.x, a.y, a.z}, {b.x, b.y, b.z}};
}

__device__ inline Ends load_row(const Row<double>* rows, u32 v) {
  const double2 a = __ldg(&rows[v].t0[0]), b = __ldg(&rows[v].t0[1]), c = __ldg(&rows[v].t1[0]), d = __ldg(&rows[v].t1[1]);
  return {{a.x, a.y, b.x}, {c.x, c.y, d.x}};
}

// The vectors of motion.h; v as in the public queries: v f0 f1 f2 or a0 a1 b0 b1. The differences of load.inl.
template <Kind kind, class T>
__device__ inline Motion<double> load_motion(const Row<T>* rows, uint4 v) {
  const Ends q0 = load_row(rows, v.x), q1 = load_row(rows, v.y), q2 = load_row(rows, v.z), q3 = load_row(rows, v.w);
  if constexpr (kind == Kind::vertex_face)
    return {q0.t0 - q1.t0, q2.t0 - q1.t0, q3.t0 - q1.t0, q0.t1 - q1.t1, q2.t1 - q1.t1, q3.t1 - q1.t1};
  else
    return {q2.t0 - q0.t0, q1.t0 - q0.t0, q3.t0 - q2.t0, q2.t1 - q0.t1, q1.t1 - q0.t1, q3.t1 - q2.t1};
}

template <Kind kind, class T>
__device__ inline uint4 vertices_of(const Frame<T>& f, u32 first, u32 second) {
  if constexpr (kind == Kind::vertex_face) {
    const u32* corner = f.faces + 3 * static_cast<u64>(second);
    return {first, __ldg(corner), __ldg(corner + 1), __ldg(corner + 2)};
  } else {
    const uint2 a = __ldg(f.edges + first), b = __ldg(f.edges + second);
    return {a.x, a.y, b.x, b.y};
  }
}

template <class T>
__device__ inline Accuracy accuracy_of(const Frame<T>& f, uint4 v) {
  if (!f.accuracy) return f.default_accuracy;
  // The second vertex belongs to the first edge or to the face, the third to the other edge or the face.
  return static_cast<Accuracy>(f.accuracy[f.mesh_of_vertex[v.x] * f.n_meshes + f.mesh_of_vertex[v.z]]);
}

}  // namespace hpccd::gpu
