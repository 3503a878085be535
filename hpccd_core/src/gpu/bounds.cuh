// SPDX-License-Identifier: Apache-2.0
// bvh/motion_bounds.cpp on the device, with the same arithmetic: extent of the scene, then both ends and the box of
// each vertex.
#pragma once

#include "bvh/coordinate_map.h"
#include "bvh/kdop.h"
#include "bvh/tree.h"
#include "gpu/best_time.cuh"
#include "gpu/launch_params.cuh"
#include "gpu/reach.h"
#include "scene/edge_sample.h"

namespace hpccd::gpu {

// The extent of a world in a frame, from its counters, and the resulting map of its coordinates.

// Maps the bits of a double to an integer with the order of the numbers.
__device__ inline u64 ordered_bits(double x) {
  const u64 b = static_cast<u64>(__double_as_longlong(x));
  return b >> 63 ? ~b : b | (u64{1} << 63);
}
__device__ inline double from_ordered_bits(u64 b) {
  return __longlong_as_double(static_cast<long long>(b >> 63 ? b & ~(u64{1} << 63) : ~b));
}

struct SceneExtent {
  double low[3], high[3];

  __device__ explicit SceneExtent(const WorldCounters& c) {
    for (int k = 0; k < 3; ++k)
      low[k] = from_ordered_bits(~c.extent_low[k]), high[k] = from_ordered_bits(c.extent_high[k]);
  }
  __device__ CoordinateMap map() const { return CoordinateMap::around(low, high); }
  __device__ double largest() const {
    double x = 0;
    for (int k = 0; k < 3; ++k) x = greater(x, greater(magnitude(low[k]), magnitude(high[k])));
    return x;
  }
};

// Uses the same number of blocks for each world.
template <class T>
__global__ void extent_kernel(LaunchParams<T> params) {
  double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
  bool bad = false;
  const u32 all = gridDim.x * blockDim.x, own = blockIdx.x * blockDim.x + threadIdx.x;
  if (params.n_of_group)
    for (u32 i = own; i < params.all_vertices() + params.all_edges(); i += all) params.n_of_group[i] = 0;
  const u32 blocks = gridDim.x / params.n_worlds, world = blockIdx.x / blocks;
  const u64 base = static_cast<u64>(world) * params.n_vertices;
  for (u32 i = (blockIdx.x - world * blocks) * blockDim.x + threadIdx.x; i < params.n_vertices;
       i += blocks * blockDim.x)
    for (int k = 0; k < 3; ++k) {
      const double a = params.given_t0[3 * (base + i) + k], b = params.given_t1[3 * (base + i) + k];
      bad = bad || !(fabs(a) <= params.largest) || !(fabs(b) <= params.largest);
      low[k] = fmin(low[k], fmin(a, b));
      high[k] = fmax(high[k], fmax(a, b));
    }
  for (int k = 0; k < 3; ++k)
    for (int d = 16; d > 0; d /= 2) {
      low[k] = fmin(low[k], __shfl_xor_sync(all_lanes, low[k], d));
      high[k] = fmax(high[k], __shfl_xor_sync(all_lanes, high[k], d));
    }
  __shared__ double part[32][6];
  const u32 warp = threadIdx.x / 32, n_warps = blockDim.x / 32;
  if (lane_number() == 0)
    for (int k = 0; k < 3; ++k) part[warp][k] = low[k], part[warp][3 + k] = high[k];
  if (bad) atomicAdd(&params.counters->bad, u64{1});
  __syncthreads();
  if (threadIdx.x >= 3) return;
  const u32 k = threadIdx.x;
  for (u32 w = 0; w < n_warps; ++w)
    low[0] = fmin(w ? low[0] : INFINITY, part[w][k]), high[0] = fmax(w ? high[0] : -INFINITY, part[w][3 + k]);
  atomicMax(&params.worlds[world].extent_low[k], ~ordered_bits(low[0]));
  atomicMax(&params.worlds[world].extent_high[k], ordered_bits(high[0]));
}

__device__ inline void set_ends(GivenEnds<float>& r, const float* a, const float* b) {
  r.t0 = {a[0], a[1], a[2], 0}, r.t1 = {b[0], b[1], b[2], 0};
}
__device__ inline void set_ends(GivenEnds<double>& r, const double* a, const double* b) {
  r.t0[0] = {a[0], a[1]}, r.t0[1] = {a[2], 0}, r.t1[0] = {b[0], b[1]}, r.t1[1] = {b[2], 0};
}

// The position of a vertex at a time between its ends, and the rounding errors of this number as a float (and of
// growing another vertex's box by it): half of 2^-22 for each of the three operations, for coordinates up to 2.25.
__device__ inline float place_at(double time, double t0, double t1) {
  return static_cast<float>(t0 + time * (t1 - t0));
}
inline constexpr float lost_by_place = 4.8e-7f;

template <class T>
__device__ double extent_of(const T* from, const T* to) {
  double length = 0;
  for (int k = 0; k < 3; ++k) length = fmax(length, fabs(double{from[k]} - double{to[k]}));
  return length;
}

// scene/edge_sample.h, one block per world: the edge with the right number of shorter ones decides. Points are no
// edges.
template <class T>
__global__ void floats_suffice_kernel(LaunchParams<T> params) {
  __shared__ double lengths[2 * edges_of_a_step];
  __shared__ u32 n_edges;
  if (threadIdx.x == 0) n_edges = 0;
  __syncthreads();
  const EdgeSample sample = EdgeSample::of(params.n_edges, edges_of_a_step);
  const u64 base = static_cast<u64>(blockIdx.x) * params.n_vertices;
  WorldCounters& world = params.worlds[blockIdx.x];
  for (std::size_t i = threadIdx.x; i < sample.count; i += blockDim.x) {
    const uint2 edge = params.edges[i * sample.stride];
    if (edge.x == edge.y) {
      lengths[i] = INFINITY;
      continue;
    }
    atomicAdd(&n_edges, 1u);
    const u64 a = 3 * (base + edge.x), b = 3 * (base + edge.y);
    lengths[i] =
        fmin(extent_of(params.given_t0 + a, params.given_t0 + b), extent_of(params.given_t1 + a, params.given_t1 + b));
  }
  __syncthreads();
  for (std::size_t i = threadIdx.x; i < sample.count; i += blockDim.x) {
    std::size_t below = 0;
    for (std::size_t j = 0; j < sample.count; ++j)
      below += lengths[j] < lengths[i] || (lengths[j] == lengths[i] && j < i);
    if (below != EdgeSample{sample.stride, n_edges}.short_one() || lengths[i] == INFINITY) continue;
    if (!floats_suffice(lengths[i], SceneExtent(world).map().scale)) continue;
    world.floats_suffice = 1;
    atomicAdd(&params.counters->floats_suffice, u64{1});
  }
}

// kdops: for frames that need them.
template <bool snapshot, bool kdops, class T>
__global__ void vertices_kernel(LaunchParams<T> params) {
  const u32 i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= params.all_vertices()) return;
  const u32 world = params.by_vertices(i);
  const SceneExtent extent(params.worlds[world]);
  const CoordinateMap map = extent.map();
  const double largest = extent.largest();
  const double part = params.until_best ? until(params) : 1;
  T a[3], b[3];
  DevicePoint point;
  for (int k = 0; k < 3; ++k) {
    a[k] = params.given_t0[3 * static_cast<u64>(i) + k], b[k] = params.given_t1[3 * static_cast<u64>(i) + k];
    point.at[0].x[k] = map(a[k], k);
    point.at[1].x[k] = part < 1 ? place_at(part, map.precise(a[k], k), map.precise(b[k], k)) : map(b[k], k);
  }
  const u32 own = i - world * params.n_vertices;
  const double thickness = params.thickness.of_vertex ? params.thickness.of_vertex[own] : 0;
  const double separation =
      (params.largest_separation ? params.largest_separation[params.mesh_of_vertex[own]] : params.separation) +
      2 * thickness;
  const float reach = reach_on_device(separation, map.scale, largest);
  point.at[0].tag = __float_as_uint(reach);
  point.at[1].tag = __float_as_uint(part < 1 ? reach + lost_by_place : reach);
  if constexpr (snapshot) {
    const SlantedCoordinates slanted({a[0], a[1], a[2]}, map);
    for (int k = 0; k < 3; ++k) point.at[1].x[k] = slanted.along[k];
    point.at[1].tag = __float_as_uint(slanted_reach(reach));
  }
  if constexpr (kdops) params.kdops[i] = vertex_kdop({a[0], a[1], a[2]}, {b[0], b[1], b[2]}, map);
  set_ends(params.vertices[i], a, b);
  for (int end = 0; end < 2; ++end) store(&params.points[i].at[end], point.at[end]);
}

}  // namespace hpccd::gpu
