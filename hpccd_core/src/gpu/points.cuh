// SPDX-License-Identifier: Apache-2.0
// Winding numbers of points around a closed mesh in the snapshot of a frame (solid/winding.cpp): each thread follows
// the ray of one point.
#pragma once

#include "gpu/bounds.cuh"
#include "gpu/pipeline.h"
#include "gpu/snapshot.cuh"
#include "gpu/stages.cuh"
#include "gpu/traverse.cuh"
#include "solid/crossing.h"

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
        const Vec3<T> x = load_start(params.vertices, params.corners[leaf.first_corner + (face.corners >> 8 * j & 0xFF)]);
        q[j] = {x.x, x.y, x.z};
      }
      if (!test(face.number, q)) return false;
    }
  }
  return true;
}

__device__ inline double least_of(double a, double b, double c) { return fmin(fmin(a, b), c); }
__device__ inline double most_of(double a, double b, double c) { return fmax(fmax(a, b), c); }

template <class T>
__device__ std::int32_t winding_on_device(const LaunchParams<T>& params, u32 mesh, const PointOnDevice& point) {
  std::int32_t number = 0;
  const auto meets_ray = [&](const DeviceBox& box) {
    const float *low = box.low[0].x, *high = box.high[0].x;
    return point.at[1] >= low[1] && point.at[1] <= high[1] && point.at[2] >= low[2] && point.at[2] <= high[2] &&
           point.at[0] <= high[0];
  };
  const auto test = [&](u32, const Vec3<double>(&f)[3]) {
    const Vec3<double>& p = point.exact;
    if (p.y < least_of(f[0].y, f[1].y, f[2].y) || p.y > most_of(f[0].y, f[1].y, f[2].y) ||
        p.z < least_of(f[0].z, f[1].z, f[2].z) || p.z > most_of(f[0].z, f[1].z, f[2].z) ||
        p.x > most_of(f[0].x, f[1].x, f[2].x))
      return true;
    const Vec3<double> q[4] = {p, f[0], f[1], f[2]};
    const Crossing c = crossing(q);
    if (c.turn != 0 && c.ahead > 0) number += c.turn;
    return c.certain;
  };
  return for_faces_of_mesh(params, mesh, meets_ray, test) ? number : undecided_winding;
}

template <class T>
__global__ void winding_kernel(const __grid_constant__ LaunchParams<T> params, PointsTask task) {
  const u64 i = static_cast<u64>(blockIdx.x) * blockDim.x + threadIdx.x;
  if (i >= task.n) return;
  const PointOnDevice point(task.points + 3 * i, SceneExtent(params.worlds[0]).map());
  task.numbers[i] = winding_on_device(params, task.mesh, point);
}

}  // namespace hpccd::gpu
