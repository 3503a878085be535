// SPDX-License-Identifier: Apache-2.0
// Points, normals and nearest points with the CPU's bits, a thread a row.
#pragma once

#include "gpu/pair_ends.cuh"
#include "gpu/pair_lists.cuh"
#include "gpu/places_task.cuh"

namespace hpccd::gpu {

__device__ inline void write_vector(double* row, const Vec3<double>& v) { row[0] = v.x, row[1] = v.y, row[2] = v.z; }

// Whether the row is open.
template <Kind kind, class T>
__device__ bool write_places(const LaunchParams<T>& params, const PlacesTask& task, u64 row, uint2 pair) {
  const Outputs outputs = task.outputs;
  const uint4 v = vertices_of<kind>(params, pair.x, pair.y);
  const PairEnds q = load_pair_ends(params.vertices, v);
  const double toc = outputs.at == AtTime::contact ? task.tocs[row] : 0;
  LeftOpen arbiter;
  const PairPlaces places = pair_places<kind>(q.t0, q.t1, toc, separation_of(params, v.x, v.z), outputs, arbiter);
  if (arbiter.open) return true;
  if (outputs.points) write_vector(task.points + 3 * row, places.point);
  if (outputs.normals) write_vector(task.normals + 3 * row, places.normal);
  if (outputs.closest) {
    write_vector(task.closest + 6 * row, places.closest[0]);
    write_vector(task.closest + 6 * row + 3, places.closest[1]);
  }
  return false;
}

template <class T>
__global__ __launch_bounds__(128) void places_kernel(const __grid_constant__ LaunchParams<T> params,
                                                     const __grid_constant__ PlacesTask task) {
  const u64 n = task.n_vf + task.n_ee, stride = static_cast<u64>(gridDim.x) * blockDim.x;
  const u64 first = static_cast<u64>(blockIdx.x) * blockDim.x + threadIdx.x;
  for (u64 row = first; row - lane_number() < n; row += stride) {
    bool open = false;
    if (row < task.n_vf)
      open = write_places<Kind::vertex_face>(params, task, row, task.vf[row]);
    else if (row < n)
      open = write_places<Kind::edge_edge>(params, task, row, task.ee_features[row - task.n_vf]);
    append_key(task.open_rows, task.open_capacity, task.n_open, open, row);
  }
}

}  // namespace hpccd::gpu
