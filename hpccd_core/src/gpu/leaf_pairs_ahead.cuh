// SPDX-License-Identifier: Apache-2.0
// Prefetches a few pairs of leaves for a warp: one lane per pair, and one more for its second leaf. The data that the
// pairs need first is fetched for all of them at once.
#pragma once

#include "gpu/launch_params.cuh"

namespace hpccd::gpu {

class LeafPairsAhead {
 public:
  static constexpr u32 most = 8;

  template <class T>
  __device__ LeafPairsAhead(const LaunchParams<T>& params, u64 begin, u64 end) {
    const u64 own = begin + (lane_number() & (most - 1));
    pair_ = own < end ? params.leaf_pairs.pairs[own] : uint2{0, 0};
    const u32 first_leaf = world_of_leaves(params, pair_) * params.n_leaves;
    leaf_ =
        __ldg(reinterpret_cast<const uint4*>(params.leaves + (lane_number() & most ? pair_.y : pair_.x - first_leaf)));
  }

  // All lanes must call these.
  __device__ uint2 pair(u32 k) const {
    return {__shfl_sync(all_lanes, pair_.x, k), __shfl_sync(all_lanes, pair_.y, k)};
  }
  __device__ DeviceLeaf first(u32 k) const { return leaf_of(k); }
  __device__ DeviceLeaf second(u32 k) const { return leaf_of(k + most); }

 private:
  __device__ DeviceLeaf leaf_of(u32 lane) const {
    return {__shfl_sync(all_lanes, leaf_.x, lane), __shfl_sync(all_lanes, leaf_.y, lane),
            __shfl_sync(all_lanes, leaf_.z, lane), __shfl_sync(all_lanes, leaf_.w, lane)};
  }

  uint2 pair_;
  uint4 leaf_;
};

}  // namespace hpccd::gpu
