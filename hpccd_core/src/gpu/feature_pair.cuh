// SPDX-License-Identifier: Apache-2.0
// A pair of features: its vertices and their motion, and the rules of its meshes.
#pragma once

#include "elementary/pair_vertices.h"
#include "gpu/launch_params.cuh"

namespace hpccd::gpu {

// One vertex at both ends, as doubles.
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

// v: from pair_vertices.
template <Kind kind, class T>
__device__ inline Motion<double> load_motion(const GivenEnds<T>* vertices, uint4 v) {
  const Ends q0 = load_ends(vertices, v.x), q1 = load_ends(vertices, v.y), q2 = load_ends(vertices, v.z),
             q3 = load_ends(vertices, v.w);
  const Vec3<double> t0[4] = {q0.t0, q1.t0, q2.t0, q3.t0}, t1[4] = {q0.t1, q1.t1, q2.t1, q3.t1};
  return motion_of<kind>(t0, t1);
}

// One vertex at both ends, as floats in the coordinates of the boxes: the CPU's RoundedMotion.
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

// The vertices of an edge or a face.
struct VertexNumbers {
  u32 v[3];
  __device__ u32 operator[](int i) const { return v[i]; }
};

// The vertices of a pair, numbered through all worlds.
template <Kind kind, class T>
__device__ inline uint4 vertices_of(const LaunchParams<T>& params, u32 first, u32 second) {
  const u32 world = world_of(params, kind, first), base = world * params.n_vertices;
  // Through the read-only cache, since no kernel writes this data.
  const auto edge = [&](u32 e) {
    const uint2 v = __ldg(params.edges + e);
    return VertexNumbers{{v.x + base, v.y + base}};
  };
  const auto face = [&](u32 i) {
    const u32* v = params.faces + 3 * static_cast<u64>(i);
    return VertexNumbers{{__ldg(v) + base, __ldg(v + 1) + base, __ldg(v + 2) + base}};
  };
  u32 v[4];
  pair_vertices<kind>(kind == Kind::edge_edge ? first - world * params.n_edges : first, second, edge, face, v);
  return {v[0], v[1], v[2], v[3]};
}

template <class T>
__device__ inline u32 mesh_of(const LaunchParams<T>& params, u32 vertex) {
  return params.mesh_of_vertex[vertex - params.by_vertices(vertex) * params.n_vertices];
}

template <class T>
__device__ inline Accuracy accuracy_of(const LaunchParams<T>& params, uint4 v) {
  if (!params.accuracy) return params.default_accuracy;
  // The second vertex belongs to the first edge or to the face, the third to the other edge or the face.
  return static_cast<Accuracy>(params.accuracy[mesh_of(params, v.x) * params.n_meshes + mesh_of(params, v.z)]);
}

template <class T>
__device__ inline Accuracy reported_as(const LaunchParams<T>& params, uint4 v) {
  const Accuracy accuracy = accuracy_of(params, v);
  return params.time_only && accuracy == Accuracy::exact ? Accuracy::conservative : accuracy;
}

// The separation of two features, by one vertex of each.
template <class T>
__device__ inline double separation_of(const LaunchParams<T>& params, u32 first, u32 second) {
  if (!params.separations) return params.separation;
  return params.separations[mesh_of(params, first) * params.n_meshes + mesh_of(params, second)];
}

// The thickness of both features, by number: the first one through all worlds.
template <class T>
__device__ inline double thickness_of(const LaunchParams<T>& params, Kind kind, u32 first, u32 second) {
  const Thicknesses& t = params.thickness;
  if (!t.of_vertex) return 0;
  const u32 world = world_of(params, kind, first);
  return kind == Kind::edge_edge ? t.of_edge[first - world * params.n_edges] + t.of_edge[second]
                                 : t.of_vertex[first - world * params.n_vertices] + t.of_face[second];
}

// The same with their thickness: Separations::look_up on the device.
template <class T>
__device__ inline double separation_of(const LaunchParams<T>& params, Kind kind, uint2 pair, u32 first, u32 second) {
  return separation_of(params, first, second) + thickness_of(params, kind, pair.x, pair.y);
}

// Both ends of a pair, in the order of pair_vertices, for tests that need more than its spanning vectors.
struct PairEnds {
  Vec3<double> t0[4], t1[4];
};

template <class T>
__device__ __forceinline__ PairEnds load_pair_ends(const GivenEnds<T>* vertices, uint4 v) {
  const Ends r[4] = {load_ends(vertices, v.x), load_ends(vertices, v.y), load_ends(vertices, v.z),
                     load_ends(vertices, v.w)};
  return {{r[0].t0, r[1].t0, r[2].t0, r[3].t0}, {r[0].t1, r[1].t1, r[2].t1, r[3].t1}};
}

template <class T>
__device__ __forceinline__ uint4 vertices_of(const LaunchParams<T>& params, const Candidate& pair) {
  return pair.kind == Kind::edge_edge ? vertices_of<Kind::edge_edge>(params, pair.first, pair.second)
                                      : vertices_of<Kind::vertex_face>(params, pair.first, pair.second);
}

}  // namespace hpccd::gpu
