// SPDX-License-Identifier: Apache-2.0
// Writes the outputs of one row.
#pragma once

#include "gpu/places_task.cuh"

namespace hpccd::gpu {

__device__ inline void write_vector(double* to, const Vec3<double>& v) { to[0] = v.x, to[1] = v.y, to[2] = v.z; }

__device__ inline void write_places(const PlacesOut& out, u64 row, const PairPlaces& places) {
  if (out.outputs.points) write_vector(out.points + 3 * row, places.point);
  if (out.outputs.normals) write_vector(out.normals + 3 * row, places.normal);
  if (out.outputs.closest)
    for (int i = 0; i < 2; ++i) write_vector(out.closest + 6 * row + 3 * i, places.closest[i]);
  if (!out.outputs.weights) return;
  for (int i = 0; i < 4; ++i) out.weights[4 * row + i] = places.weights[i];
  if (out.outputs.at == AtTime::contact) out.approach[row] = places.approach;
}

template <class Arbiter, Kind kind>
__device__ bool find_places(const PlacesOut& out, const OpenRow& row) {
  Arbiter arbiter;
  const PairPlaces places = pair_places<kind>(row.t0, row.t1, row.toc, row.separation, out.outputs, arbiter);
  if (!arbiter.open) write_places(out, row.row, places);
  return !arbiter.open;
}

// False if they stay open.
template <class Arbiter>
__device__ bool find_places(const PlacesTask& task, const OpenRow& row) {
  return row.row < task.n_rows[0] ? find_places<Arbiter, Kind::vertex_face>(task.out, row)
                                  : find_places<Arbiter, Kind::edge_edge>(task.out, row);
}

}  // namespace hpccd::gpu
