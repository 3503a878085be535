// SPDX-License-Identifier: Apache-2.0
// Sorted contacts as the caller sees them, written straight into page-locked host memory, and their hash.
#pragma once

#include "contacts/hash.h"
#include "gpu/launch_params.cuh"

namespace hpccd::gpu {

__global__ void number_kernel(u32* numbers, u32 n) {
  const u32 i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < n) numbers[i] = i;
}

template <class T>
__global__ void results_kernel(LaunchParams<T> params, const u64* keys, const u32* order, u32 n, u32 n_vf, uint2* vf,
                               uint4* ee, double* toc) {
  u64 hash = 0;
  for (u32 i = blockIdx.x * blockDim.x + threadIdx.x; i < n; i += gridDim.x * blockDim.x) {
    const Candidate pair = params.keys.pair_of(keys[i]);
    const u32 first = pair.first, second = pair.second;
    const double t = params.found_tocs[order[i]];
    toc[i] = t;
    if (i < n_vf) {
      vf[i] = {first, second};
      hash += hash_of(Kind::vertex_face, first, second, t);
    } else {
      const uint2 a = params.edges[first], b = params.edges[second];
      ee[i - n_vf] = {a.x, a.y, b.x, b.y};
      hash += hash_of(Kind::edge_edge, pack(a.x, a.y), pack(b.x, b.y), t);
    }
  }
  for (int d = 16; d > 0; d /= 2) hash += __shfl_xor_sync(all_lanes, hash, d);
  if (lane_number() == 0 && hash) atomicAdd(&params.counters->hash, hash);
}

// Of edges and faces.
template <class T>
__global__ void intersections_kernel(LaunchParams<T> params, const u64* keys, u32 n, uint3* ef) {
  u64 hash = 0;
  for (u32 i = blockIdx.x * blockDim.x + threadIdx.x; i < n; i += gridDim.x * blockDim.x) {
    const Candidate pair = params.keys.pair_of(keys[i]);
    const uint2 edge = params.edges[pair.first];
    ef[i] = {edge.x, edge.y, pair.second};
    hash += hash_of(Kind::edge_face, pack(edge.x, edge.y), pair.second, 0);
  }
  for (int d = 16; d > 0; d /= 2) hash += __shfl_xor_sync(all_lanes, hash, d);
  if (lane_number() == 0 && hash) atomicAdd(&params.counters->hash, hash);
}

}  // namespace hpccd::gpu
