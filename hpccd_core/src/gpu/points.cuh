// SPDX-License-Identifier: Apache-2.0
// Winding numbers and signed distances of points in the snapshot of a frame (solid/winding.cpp, nearest_face.cpp): one
// thread for each point.
#pragma once

#include "gpu/bounds.cuh"
#include "gpu/pipeline.h"
#include "gpu/snapshot.cuh"
#include "gpu/stages.cuh"
#include "gpu/traverse.cuh"
#include "solid/crossing.h"
#include "solid/nearest_place.h"

namespace hpccd::gpu {

// A point in double precision, and in the coordinates of the boxes.
struct PointOnDevice {
  Vec3<double> exact;
  float at[3];

  // Far outside the scene, the order is kept where floats end.
  __device__ PointOnDevice(const double* x, const CoordinateMap& map) : exact{x[0], x[1], x[2]} {
    for (int k = 0; k < 3; ++k) at[k] = static_cast<float>(fmin(fmax(map.precise(x[k], k), -1e30), 1e30));
  }
};

// Calls test(corners of a face), until it returns false, for the faces of a mesh in the leaves whose boxes `meets`
// selects; false if a test was. One world.
template <class T, class Meets, class Test>
__device__ bool for_faces_of_mesh(const LaunchParams<T>& params, u32 mesh, Meets&& meets, Test&& test) {
  u32 stack[traverse_depth + 2], n_stack = 1;
  stack[0] = 0;
#pragma unroll 1
  while (n_stack > 0) {
    const u32 node = stack[--n_stack], of = params.node_mesh[node];
    if (of != no_mesh && of != mesh) continue;
    const DeviceBox box = load_box(&params.node_boxes[node]);
    if (!meets(box)) continue;
    if (box.tag_low() != 0) {
      stack[n_stack++] = box.tag_low() + 1, stack[n_stack++] = box.tag_low();
      continue;
    }
    const DeviceLeaf leaf = params.leaves[box.tag_high()];
#pragma unroll 1
    for (u32 i = 0; i < leaf.n_faces(); ++i) {
      const LeafFeature face = params.leaf_faces[leaf.first_face + i];
      Vec3<double> q[3];
      for (u32 j = 0; j < 3; ++j) {
        const Vec3<T> x =
            load_start(params.vertices, params.corners[leaf.first_corner + (face.corners >> 8 * j & 0xFF)]);
        q[j] = {x.x, x.y, x.z};
      }
      if (!test(face.number, q)) return false;
    }
  }
  return true;
}

__device__ inline double least_of(double a, double b, double c) { return fmin(fmin(a, b), c); }
__device__ inline double most_of(double a, double b, double c) { return fmax(fmax(a, b), c); }

// Adds the crossing of the ray from p along the first axis with a face. False if only integers can decide.
__device__ inline bool add_crossing(const Vec3<double>& p, const Vec3<double> (&f)[3], std::int32_t& number) {
  if (p.y < least_of(f[0].y, f[1].y, f[2].y) || p.y > most_of(f[0].y, f[1].y, f[2].y) ||
      p.z < least_of(f[0].z, f[1].z, f[2].z) || p.z > most_of(f[0].z, f[1].z, f[2].z) ||
      p.x > most_of(f[0].x, f[1].x, f[2].x))
    return true;
  const Vec3<double> q[4] = {p, f[0], f[1], f[2]};
  const Crossing c = crossing(q);
  if (c.turn != 0 && c.ahead > 0) number += c.turn;
  return c.certain;
}

// Whether the ray may meet a box.
__device__ inline bool meets_ray(const PointOnDevice& point, const DeviceBox& box) {
  const float *low = box.low[0].x, *high = box.high[0].x;
  return point.at[1] >= low[1] && point.at[1] <= high[1] && point.at[2] >= low[2] && point.at[2] <= high[2] &&
         point.at[0] <= high[0];
}

template <class T>
__device__ std::int32_t winding_on_device(const LaunchParams<T>& params, u32 mesh, const PointOnDevice& point) {
  std::int32_t number = 0;
  const auto meets = [&](const DeviceBox& box) { return meets_ray(point, box); };
  const auto test = [&](u32, const Vec3<double>(&f)[3]) { return add_crossing(point.exact, f, number); };
  return for_faces_of_mesh(params, mesh, meets, test) ? number : undecided_winding;
}

template <class T>
__global__ void winding_kernel(const __grid_constant__ LaunchParams<T> params, PointsTask task) {
  const u64 i = static_cast<u64>(blockIdx.x) * blockDim.x + threadIdx.x;
  if (i >= task.n) return;
  const PointOnDevice point(task.points + 3 * i, SceneExtent(params.worlds[0]).map());
  task.numbers[i] = winding_on_device(params, task.mesh, point);
}

// The smallest and largest coordinates of a mesh's vertices. extent: zeros before.
template <class T>
__global__ void mesh_extent_kernel(const __grid_constant__ LaunchParams<T> params, PointsTask task) {
  double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
  for (u32 i = blockIdx.x * blockDim.x + threadIdx.x; i < params.n_vertices; i += gridDim.x * blockDim.x) {
    if (params.mesh_of_vertex[i] != task.mesh) continue;
    for (int k = 0; k < 3; ++k) {
      const double x = params.given_t0[3 * static_cast<u64>(i) + k];
      low[k] = fmin(low[k], x), high[k] = fmax(high[k], x);
    }
  }
  for (int k = 0; k < 3; ++k) {
    for (int d = 16; d > 0; d /= 2) {
      low[k] = fmin(low[k], __shfl_xor_sync(all_lanes, low[k], d));
      high[k] = fmax(high[k], __shfl_xor_sync(all_lanes, high[k], d));
    }
    if (lane_number() != 0 || low[k] > high[k]) continue;
    atomicMax(&task.extent->extent_low[k], ~ordered_bits(low[k]));
    atomicMax(&task.extent->extent_high[k], ordered_bits(high[k]));
  }
}

// The nearest face, by branch and bound. Undecided: a needle may be as near, the face contains the point, or the point
// is far away.
template <class T>
__device__ PointOnFace nearest_on_device(const LaunchParams<T>& params, u32 mesh, const PointOnDevice& point,
                                         const SceneExtent& extent, const CoordinateMap& map) {
  const double at[3] = {point.exact.x, point.exact.y, point.exact.z};
  double most = 0, size = 0, away = 0;
  for (int k = 0; k < 3; ++k) {
    most = greater(most, greater(fabs(extent.low[k] - at[k]), fabs(extent.high[k] - at[k])));
    size = greater(size, extent.high[k] - extent.low[k]);
    away = greater(away, fabs(at[k] - (0.5 * extent.low[k] + 0.5 * extent.high[k])));
  }
  const double scale = scale_for(most);
  PointOnFace best{undecided_distance, {}, no_mesh, 0};
  if (away / far_away > size) return best;
  // A mapped coordinate x is rounded by 2^-24 |x|, vertices are within 2.25, and a difference is rounded once more:
  // 2^-23 (|x| + 2.25) along each axis.
  float farthest = 0;
  for (int k = 0; k < 3; ++k) farthest = fmaxf(farthest, fabsf(point.at[k]));
  const double units = map.scale / scale, slack = 2.1e-7 * (double{farthest} + 2.25);

  double least = INFINITY, limit = INFINITY;  // squares: of the distance, scaled, and of gaps of boxes that matter
  u32 nearest = no_mesh;
  bool certain = true;
  const auto square_of_gap = [&](const DeviceBox& box) {
    float s = 0;
    for (int k = 0; k < 3; ++k) {
      const float gap = fmaxf(fmaxf(box.low[0].x[k] - point.at[k], point.at[k] - box.high[0].x[k]), 0.0f);
      s += gap * gap;
    }
    return s;
  };
  const auto scaled = [&](u32 number) {
    const u32* f = params.faces + 3 * static_cast<u64>(number);
    const SortedFace sorted(__ldg(f), __ldg(f + 1), __ldg(f + 2));
    Vec3<double> corners[3];
    for (int i = 0; i < 3; ++i) {
      const Vec3<T> x = load_start(params.vertices, sorted.vertex[i]);
      corners[i] = {x.x, x.y, x.z};
    }
    return ScaledFace(point.exact, scale, corners);
  };
  const auto consider = [&](u32 number) {
    const ScaledFace face = scaled(number);
    const PlaceOnFace place = face.nearest();
    if (!place.certain) {
      certain = certain && sqrt(place.square) - face.height_of_needle() - largest_scaled_error > sqrt(least);
      return;
    }
    if (place.square > least || (place.square == least && number >= nearest)) return;
    least = place.square, nearest = number;
    const double reach = (sqrt(least) * (1 + 1e-9) + largest_scaled_error) * units + slack;
    limit = reach * reach * (1 + 1e-6);
  };

  struct Pending {
    u32 node;
    float gap;
  };
  Pending stack[traverse_depth + 2];
  u32 n_stack = 1;
  stack[0] = {0, 0};
#pragma unroll 1
  while (n_stack > 0 && certain) {
    const Pending next = stack[--n_stack];
    const u32 of = params.node_mesh[next.node];
    if (next.gap > limit || (of != no_mesh && of != mesh)) continue;
    const DeviceBox box = load_box(&params.node_boxes[next.node]);
    if (const u32 left = box.tag_low()) {
      const Pending a{left, square_of_gap(load_box(&params.node_boxes[left]))};
      const Pending b{left + 1, square_of_gap(load_box(&params.node_boxes[left + 1]))};
      stack[n_stack++] = b.gap < a.gap ? a : b, stack[n_stack++] = b.gap < a.gap ? b : a;
      continue;
    }
    const DeviceLeaf leaf = params.leaves[box.tag_high()];
#pragma unroll 1
    for (u32 i = 0; i < leaf.n_faces(); ++i) consider(params.leaf_faces[leaf.first_face + i].number);
  }
  if (!certain || !(least > 0) || nearest == no_mesh) return best;
  const ScaledFace face = scaled(nearest);
  return {sqrt(least) / scale, face.point_at(face.nearest()), nearest, 0};
}

template <class T>
__global__ void nearest_kernel(const __grid_constant__ LaunchParams<T> params, PointsTask task) {
  const u64 i = static_cast<u64>(blockIdx.x) * blockDim.x + threadIdx.x;
  if (i >= task.n) return;
  const CoordinateMap map = SceneExtent(params.worlds[0]).map();
  const PointOnDevice point(task.points + 3 * i, map);
  task.nearest[i] = nearest_on_device(params, task.mesh, point, SceneExtent(*task.extent), map);
}

}  // namespace hpccd::gpu
