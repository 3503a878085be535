// SPDX-License-Identifier: Apache-2.0
// Outputs of pairs, bit-identical to the CPU's, one thread per row.
#include "gpu/feature_pair.cuh"
#include "gpu/pair_lists.cuh"
#include "gpu/write_places.cuh"

namespace hpccd::gpu {
namespace {

// The world of a row, by the offsets of the worlds.
__device__ u32 world_of_row(const u64* offsets, u32 n_worlds, u64 row) {
  u32 low = 0, high = n_worlds;
  while (high - low > 1) {
    const u32 middle = low + (high - low) / 2;
    (offsets[middle] <= row ? low : high) = middle;
  }
  return low;
}

// The vertices of a row as those of pairs, numbered through all worlds; `base`: those of the worlds before.
template <class T>
__device__ uint4 vertices_of_row(const LaunchParams<T>& params, const PlacesTask& task, u64 row, u32& base) {
  const bool edges = row >= task.n_rows[0];
  const u64 own = edges ? row - task.n_rows[0] : row;
  const u32 world =
      params.n_worlds == 1 ? 0 : world_of_row(edges ? task.ee_offsets : task.vf_offsets, params.n_worlds, own);
  base = world * params.n_vertices;
  uint4 v;
  if (edges) {
    v = task.ee[own];
  } else {
    const u32* face = params.faces + 3 * static_cast<u64>(task.vf[own].y);
    v = {task.vf[own].x, __ldg(face), __ldg(face + 1), __ldg(face + 2)};
  }
  return {v.x + base, v.y + base, v.z + base, v.w + base};
}

// The edge with these vertices of its world. Edges are in lexicographic order.
template <class T>
__device__ u32 edge_number(const LaunchParams<T>& params, u32 a, u32 b) {
  u32 begin = 0, end = params.n_edges;
  while (begin + 1 < end) {
    const u32 middle = begin + (end - begin) / 2;
    const uint2 e = params.edges[middle];
    (e.x < a || (e.x == a && e.y <= b) ? begin : end) = middle;
  }
  return begin;
}

template <class T>
__device__ double separation_of_row(const LaunchParams<T>& params, const PlacesTask& task, u64 row, uint4 v, u32 base) {
  const double of_meshes = separation_of(params, v.x, v.z);
  if (!params.thickness.of_vertex) return of_meshes;
  if (row < task.n_rows[0]) return of_meshes + thickness_of(params, Kind::vertex_face, v.x, task.vf[row].y);
  const u32 world = base / params.n_vertices;
  return of_meshes + thickness_of(params, Kind::edge_edge,
                                  world * params.n_edges + edge_number(params, v.x - base, v.y - base),
                                  edge_number(params, v.z - base, v.w - base));
}

template <class T>
__global__ __launch_bounds__(128) void places_kernel(const __grid_constant__ LaunchParams<T> params,
                                                     const __grid_constant__ PlacesTask task) {
  const u64 n = task.n_rows[0] + task.n_rows[1], stride = static_cast<u64>(gridDim.x) * blockDim.x;
  for (u64 i = static_cast<u64>(blockIdx.x) * blockDim.x + threadIdx.x; i < n; i += stride) {
    u32 base;
    const uint4 v = vertices_of_row(params, task, i, base);
    if (task.out.outputs.weights) task.out.vertices[i] = {v.x - base, v.y - base, v.z - base, v.w - base};
    const PairEnds q = load_pair_ends(params.vertices, v);
    OpenRow row;
    row.row = i, row.toc = task.tocs[i], row.separation = separation_of_row(params, task, i, v, base);
    for (int k = 0; k < 4; ++k) row.t0[k] = q.t0[k], row.t1[k] = q.t1[k];
    if (find_places<LeftOpen>(task, row)) continue;
    // Each lane separately: a warp may have diverged here (item_of_thread.cuh).
    const u64 at = atomicAdd(task.n_open, u64{1});
    if (at < task.open_capacity) task.open[at] = row;
  }
}

__global__ void put_places_kernel(const __grid_constant__ PlacesOut out, const OpenRow* open, const PairPlaces* places,
                                  u64 n) {
  const u64 i = static_cast<u64>(blockIdx.x) * blockDim.x + threadIdx.x;
  if (i < n) write_places(out, open[i].row, places[i]);
}

}  // namespace

template <class T>
void launch_places(const LaunchParams<T>& params, const PlacesTask& task, const Stages& stages) {
  constexpr unsigned threads = 128;
  const auto kernel = places_kernel<T>;
  const int blocks = blocks_that_fit(reinterpret_cast<const void*>(kernel), threads, "places_kernel");
  kernel<<<static_cast<unsigned>(blocks * stages.multiprocessors), threads, 0, stages.stream>>>(params, task);
  check_launch("places_kernel");
  stages.mark("places");
}

void launch_put(const PlacesOut& out, const OpenRow* open, const PairPlaces* places, u64 n, const Stages& stages) {
  put_places_kernel<<<blocks_for(n, 128), 128, 0, stages.stream>>>(out, open, places, n);
  check_launch("put_places_kernel");
}

template void launch_places(const LaunchParams<float>&, const PlacesTask&, const Stages&);
template void launch_places(const LaunchParams<double>&, const PlacesTask&, const Stages&);

}  // namespace hpccd::gpu
