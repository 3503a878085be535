// SPDX-License-Identifier: Apache-2.0
// Points, normals and nearest points with the CPU's bits, a thread a row.
#include "gpu/pair_ends.cuh"
#include "gpu/pair_lists.cuh"
#include "gpu/places_task.cuh"

namespace hpccd::gpu {
namespace {

// The world whose rows, from offsets[world] on, hold this one.
__device__ u32 world_of_row(const u64* offsets, u32 n_worlds, u64 row) {
  u32 low = 0, high = n_worlds;
  while (high - low > 1) {
    const u32 middle = low + (high - low) / 2;
    (offsets[middle] <= row ? low : high) = middle;
  }
  return low;
}

__device__ void write_vector(double* to, const Vec3<double>& v) { to[0] = v.x, to[1] = v.y, to[2] = v.z; }

__device__ void write_places(const PlacesOut& out, u64 row, const PairPlaces& places) {
  if (out.outputs.points) write_vector(out.points + 3 * row, places.point);
  if (out.outputs.normals) write_vector(out.normals + 3 * row, places.normal);
  if (!out.outputs.closest) return;
  for (int i = 0; i < 2; ++i) write_vector(out.closest + 6 * row + 3 * i, places.closest[i]);
}

// The vertices of a row as those of pairs, numbered through all worlds.
template <class T>
__device__ uint4 vertices_of_row(const LaunchParams<T>& params, const PlacesTask& task, u64 row) {
  const bool edges = row >= task.n_vf;
  const u64 own = edges ? row - task.n_vf : row;
  const u32 world =
      params.n_worlds == 1 ? 0 : world_of_row(edges ? task.ee_offsets : task.vf_offsets, params.n_worlds, own);
  const u32 base = world * params.n_vertices;
  uint4 v;
  if (edges) {
    v = task.ee[own];
  } else {
    const u32* face = params.faces + 3 * static_cast<u64>(task.vf[own].y);
    v = {task.vf[own].x, __ldg(face), __ldg(face + 1), __ldg(face + 2)};
  }
  return {v.x + base, v.y + base, v.z + base, v.w + base};
}

template <Kind kind>
__device__ bool find_places(const PlacesTask& task, const OpenRow& row) {
  LeftOpen arbiter;
  const UndecidedPair& q = row.pair;
  const PairPlaces places = pair_places<kind>(q.t0, q.t1, row.toc, q.separation, task.out.outputs, arbiter);
  if (!arbiter.open) write_places(task.out, row.row, places);
  return arbiter.open;
}

template <class T>
__global__ __launch_bounds__(128) void places_kernel(const __grid_constant__ LaunchParams<T> params,
                                                     const __grid_constant__ PlacesTask task) {
  const u64 n = task.n_vf + task.n_ee, stride = static_cast<u64>(gridDim.x) * blockDim.x;
  for (u64 i = static_cast<u64>(blockIdx.x) * blockDim.x + threadIdx.x; i - lane_number() < n; i += stride) {
    bool open = false;
    OpenRow row;
    if (i < n) {
      const uint4 v = vertices_of_row(params, task, i);
      const PairEnds q = load_pair_ends(params.vertices, v);
      row.row = i, row.toc = task.tocs[i];
      row.pair.kind = i < task.n_vf ? Kind::vertex_face : Kind::edge_edge;
      row.pair.separation = separation_of(params, v.x, v.z);
      for (int k = 0; k < 4; ++k) row.pair.t0[k] = q.t0[k], row.pair.t1[k] = q.t1[k];
      open = i < task.n_vf ? find_places<Kind::vertex_face>(task, row) : find_places<Kind::edge_edge>(task, row);
    }
    const u64 at = warp_append(task.n_open, open);
    if (open && at < task.open_capacity) task.open[at] = row;
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
