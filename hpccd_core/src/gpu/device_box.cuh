// SPDX-License-Identifier: Apache-2.0
// Bounds of vertices and features on the device (bvh/motion_box.h), in 16-byte words.
#pragma once

#include "base/hd.h"
#include "gpu/counters.cuh"
#include "gpu/query.h"

namespace hpccd::gpu {

// A 16-byte word; the meaning of a box's tags depends on the list.
struct alignas(16) Bound {
  float x[3];
  u32 tag;
};

// The position of a vertex at both ends of its motion, or of the part that matters; for a snapshot, its coordinates
// along the axes and along the slanted directions (bvh/kdop.h). The tags hold the amount by which its box grows there
// (a float).
struct alignas(32) DevicePoint {
  Bound at[2];
};

// Bounds at both ends of the motion (bvh/motion_box.h).
struct alignas(64) DeviceBox {
  Bound low[2], high[2];
  HPCCD_HD u32& tag_low() { return low[0].tag; }
  HPCCD_HD u32& tag_high() { return high[0].tag; }
  HPCCD_HD u32 tag_low() const { return low[0].tag; }
  HPCCD_HD u32 tag_high() const { return high[0].tag; }
};

__device__ inline Bound bound_of(float4 v) { return {{v.x, v.y, v.z}, __float_as_uint(v.w)}; }

__device__ inline DeviceBox load_box(const DeviceBox* b) {
  const float4* v = reinterpret_cast<const float4*>(b);
  return {{bound_of(v[0]), bound_of(v[1])}, {bound_of(v[2]), bound_of(v[3])}};
}

// Bypasses this multiprocessor's cache: another one wrote the box in the same kernel.
__device__ inline DeviceBox load_box_fresh(const DeviceBox* b) {
  const float4* v = reinterpret_cast<const float4*>(b);
  return {{bound_of(__ldcg(v)), bound_of(__ldcg(v + 1))}, {bound_of(__ldcg(v + 2)), bound_of(__ldcg(v + 3))}};
}

// The box of one vertex. The caller must set the tags of a grown one.
template <bool grown>
__device__ inline DeviceBox load_point(const DevicePoint* p) {
  const float4* v = reinterpret_cast<const float4*>(p);
  const Bound t0 = bound_of(v[0]), t1 = bound_of(v[1]);
  DeviceBox b{{t0, t1}, {t0, t1}};
  if constexpr (grown) {
    const float reach[2] = {__uint_as_float(t0.tag), __uint_as_float(t1.tag)};
    for (int end = 0; end < 2; ++end)
      for (int k = 0; k < 3; ++k) b.low[end].x[k] -= reach[end], b.high[end].x[k] += reach[end];
  }
  return b;
}

__device__ inline void store(Bound* to, const Bound& b) {
  *reinterpret_cast<float4*>(to) = {b.x[0], b.x[1], b.x[2], __uint_as_float(b.tag)};
}
__device__ inline void store_box(DeviceBox* to, const DeviceBox& b) {
  for (int end = 0; end < 2; ++end) store(&to->low[end], b.low[end]), store(&to->high[end], b.high[end]);
}

__device__ inline void include(DeviceBox& a, const DeviceBox& b) {
  for (int end = 0; end < 2; ++end)
    for (int k = 0; k < 3; ++k) {
      a.low[end].x[k] = b.low[end].x[k] < a.low[end].x[k] ? b.low[end].x[k] : a.low[end].x[k];
      a.high[end].x[k] = a.high[end].x[k] < b.high[end].x[k] ? b.high[end].x[k] : a.high[end].x[k];
    }
}

// For a motion: not in the same order along an axis at both ends. For a snapshot: not separated along any direction.
template <Query query>
__device__ inline bool overlap(const DeviceBox& a, const DeviceBox& b) {
  bool apart = false;
  for (int k = 0; k < 3; ++k)
    if constexpr (of_snapshot(query))
      apart |= (a.high[0].x[k] < b.low[0].x[k]) | (b.high[0].x[k] < a.low[0].x[k]) | (a.high[1].x[k] < b.low[1].x[k]) |
               (b.high[1].x[k] < a.low[1].x[k]);
    else
      apart |= ((a.high[0].x[k] < b.low[0].x[k]) & (a.high[1].x[k] < b.low[1].x[k])) |
               ((b.high[0].x[k] < a.low[0].x[k]) & (b.high[1].x[k] < a.low[1].x[k]));
  return !apart;
}

}  // namespace hpccd::gpu
