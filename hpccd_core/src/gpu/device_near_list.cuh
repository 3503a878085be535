// SPDX-License-Identifier: Apache-2.0
// backends/near_list.h on the device: the near pairs of one snapshot, and how far a motion takes its vertices from the
// snapshot and in total.
#pragma once

#include <algorithm>

#include "gpu/best_time.cuh"
#include "gpu/feature_pair.cuh"
#include "gpu/pair_lists.cuh"
#include "gpu/stream.h"

namespace hpccd::gpu {

template <class T>
__global__ void take_list_kernel(LaunchParams<T> params, u32 kind, const uint2* pairs, u64 n) {
  const u64 stride = static_cast<u64>(gridDim.x) * blockDim.x, first = static_cast<u64>(blockIdx.x) * blockDim.x;
  for (u64 i = first + threadIdx.x; i < n && i < params.survivors[kind].capacity; i += stride)
    params.survivors[kind].pairs[i] = pairs[i];
  if (first + threadIdx.x == 0) params.counters->survivors[kind] = params.counters->candidates[kind] = n;
}

// snapshot: of the list; null without a list.
template <class T>
__global__ void travel_kernel(LaunchParams<T> params, const double* snapshot) {
  double way = 0, away = 0;
  const u64 n = 3 * static_cast<u64>(params.n_vertices), stride = static_cast<u64>(gridDim.x) * blockDim.x;
  for (u64 i = static_cast<u64>(blockIdx.x) * blockDim.x + threadIdx.x; i < n; i += stride) {
    const double start = params.given_t0[i], end = params.given_t1[i];
    way = fmax(way, fabs(end - start));
    if (snapshot) away = fmax(away, fabs(start - snapshot[i]));
  }
  for (int d = 16; d > 0; d /= 2) {
    way = fmax(way, __shfl_xor_sync(all_lanes, way, d));
    away = fmax(away, __shfl_xor_sync(all_lanes, away, d));
  }
  if (lane_number() != 0) return;
  atomicMax(&params.counters->way, bits_of(way));
  atomicMax(&params.counters->away, bits_of(away));
}

template <class T>
__global__ void snapshot_kernel(LaunchParams<T> params, double* snapshot) {
  const u32 i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i >= params.n_vertices) return;
  const Vec3<double> start = load_ends(params.vertices, i).t0;  // the caller's array may change
  double* to = snapshot + 3 * static_cast<u64>(i);
  to[0] = start.x, to[1] = start.y, to[2] = start.z;
}

// All results of a frame, and all pairs that it left to the host.
template <class T>
__global__ void collect_kernel(LaunchParams<T> params, u64 n_found, u64 n_to_host, PairList vf, PairList ee) {
  const u64 n = n_found + n_to_host, stride = static_cast<u64>(gridDim.x) * blockDim.x;
  for (u64 i = static_cast<u64>(blockIdx.x) * blockDim.x + threadIdx.x; i - lane_number() < n; i += stride) {
    const bool valid = i < n;
    const u64 key = !valid ? 0 : i < n_found ? params.found_keys[i] : params.to_host[i - n_found];
    const Candidate pair = params.keys.pair_of(key);
    const bool edges = pair.kind == Kind::edge_edge;
    append_pair(vf, &params.counters->listed[0], valid && !edges, {pair.first, pair.second});
    append_pair(ee, &params.counters->listed[1], valid && edges, {pair.first, pair.second});
  }
}

class DeviceNearList {
 public:
  u64 size() const { return n_[0] + n_[1]; }
  u64 most() const { return std::max(n_[0], n_[1]); }
  bool has_snapshot() const { return has_snapshot_; }

  // Takes the place of a traversal.
  template <class T>
  void take(const LaunchParams<T>& params, cudaStream_t stream) const {
    for (u32 k = 0; k < 2; ++k) {
      take_list_kernel<<<std::min(blocks_for(n_[k], 256), 1024u), 256, 0, stream>>>(params, k, pairs_[k].data(), n_[k]);
      check_launch("take_list_kernel");
    }
  }
  template <class T>
  void measure(const LaunchParams<T>& params, cudaStream_t stream) const {
    const unsigned blocks = std::min(blocks_for(std::size_t{params.n_vertices} * 3, 256), 512u);
    travel_kernel<<<blocks, 256, 0, stream>>>(params, has_snapshot_ ? snapshot_.data() : nullptr);
    check_launch("travel_kernel");
  }

  // Takes the list from the last frame, whose counters are `c`; its start becomes the snapshot. Waits for the stream.
  template <class T>
  void collect(const LaunchParams<T>& params, const Counters& c, cudaStream_t stream) {
    const u64 n = c.found_all + c.to_host;
    n_[0] = n_[1] = 0;  // no list, if this fails
    for (auto& pairs : pairs_) pairs.reserve(static_cast<std::size_t>(n + n / 4 + 1));
    const PairList lists[2] = {{pairs_[0].data(), pairs_[0].size()}, {pairs_[1].data(), pairs_[1].size()}};
    check(cudaMemsetAsync(&params.counters->listed, 0, sizeof params.counters->listed, stream), "cudaMemsetAsync");
    collect_kernel<<<std::min(blocks_for(n, 256), 1024u), 256, 0, stream>>>(params, c.found_all, c.to_host, lists[0],
                                                                            lists[1]);
    check_launch("collect_kernel");
    u64 listed[2];
    check(cudaMemcpyAsync(listed, &params.counters->listed, sizeof listed, cudaMemcpyDeviceToHost, stream),
          "cudaMemcpyAsync");
    begin_at(params, stream);
    check(cudaStreamSynchronize(stream), "cudaStreamSynchronize");
    for (int k = 0; k < 2; ++k) n_[k] = listed[k];
  }
  // Makes the last frame's start the snapshot, without a list. Does not wait for the stream.
  template <class T>
  void begin_at(const LaunchParams<T>& params, cudaStream_t stream) {
    n_[0] = n_[1] = 0, has_snapshot_ = false;
    snapshot_.reserve(std::max<std::size_t>(std::size_t{params.n_vertices} * 3, 1));
    snapshot_kernel<<<blocks_for(params.n_vertices, 256), 256, 0, stream>>>(params, snapshot_.data());
    check_launch("snapshot_kernel");
    has_snapshot_ = true;
  }

  std::size_t bytes() const { return pairs_[0].bytes() + pairs_[1].bytes() + snapshot_.bytes(); }

 private:
  DeviceBuffer<uint2> pairs_[2];  // by kind
  DeviceBuffer<double> snapshot_;
  u64 n_[2] = {0, 0};
  bool has_snapshot_ = false;
};

}  // namespace hpccd::gpu
