// SPDX-License-Identifier: Apache-2.0
// Features of two leaves in one snapshot, side by side in shared memory. The first leaf stays while others are
// compared with it: five on average on the published n-body scene.
#pragma once

#include "gpu/candidate_space.cuh"

namespace hpccd::gpu {

// Coordinates of a vertex along the axes and the slanted directions.
struct SnapshotPoint {
  float x[6];
};

__device__ inline SnapshotPoint snapshot_point(const Bound& axes, const Bound& slanted) {
  return {{axes.x[0], axes.x[1], axes.x[2], slanted.x[0], slanted.x[1], slanted.x[2]}};
}

// The amounts by which boxes grow along both: in a snapshot the same for all vertices of a world, so that the bounds
// may grow instead (rounding keeps the order of numbers).
struct SnapshotReach {
  float axes, slanted;
};

struct SnapshotBox {
  float low[6], high[6];

  __device__ static SnapshotBox of(const SnapshotPoint& p) {
    SnapshotBox b;
    for (int k = 0; k < 6; ++k) b.low[k] = b.high[k] = p.x[k];
    return b;
  }
  __device__ void include(const SnapshotPoint& p) {
    for (int k = 0; k < 6; ++k) {
      low[k] = fminf(low[k], p.x[k]);
      high[k] = fmaxf(high[k], p.x[k]);
    }
  }
  __device__ void grow(const SnapshotReach& reach) {
    for (int k = 0; k < 6; ++k) {
      const float by = k < 3 ? reach.axes : reach.slanted;
      low[k] -= by, high[k] += by;
    }
  }
};

__device__ inline SnapshotBox load_snapshot_box(const DeviceBox* from) {
  const DeviceBox b = load_box(from);
  SnapshotBox r;
  for (int k = 0; k < 6; ++k) r.low[k] = b.low[k / 3].x[k % 3], r.high[k] = b.high[k / 3].x[k % 3];
  return r;
}

__device__ inline bool overlap(const SnapshotBox& a, const SnapshotBox& b) {
  bool apart = false;
  for (int k = 0; k < 6; ++k) apart |= (a.high[k] < b.low[k]) | (b.high[k] < a.low[k]);
  return !apart;
}

// An edge repeats its second vertex, a vertex is repeated three times.
struct FeatureNumbers {
  u32 vertex[3], number;
};

// All features of a leaf in one order: edges, faces, vertices. Most leaves have fewer features than a warp has lanes.
struct LeafOrder {
  static constexpr u32 most = (3 + 1 + 3) * Tree::leaf_size, most_corners = 3 * Tree::leaf_size;
  u32 until_face, until_vertex, n;

  __device__ explicit LeafOrder(const DeviceLeaf& l)
      : until_face(l.n_edges()), until_vertex(until_face + l.n_faces()), n(until_vertex + l.n_vertices()) {}
  __device__ bool is_edge(u32 i) const { return i < until_face; }
  __device__ bool is_vertex(u32 i) const { return i >= until_vertex; }
};

// The corners of a feature, and its number if it differs from its vertex.
template <class T>
__device__ __forceinline__ LeafFeature feature_at(const LaunchParams<T>& params, const DeviceLeaf& l, u32 i) {
  const LeafOrder order(l);
  if (order.is_vertex(i)) return {0, 0x010101u * (i - order.until_vertex)};
  const bool edge = order.is_edge(i);
  LeafFeature f = load_feature(edge ? params.leaf_edges + l.first_edge : params.leaf_faces + l.first_face,
                               edge ? i : i - order.until_face);
  if (edge) f.corners = (f.corners & 0xFFFF) | (f.corners & 0xFF00) << 8;
  return f;
}

// The words of a box are stored separately, so that neighbouring lanes read neighbouring words.
struct StagedFeatures {
  float4 bound[3][LeafOrder::most];
  uint4 numbers[LeafOrder::most];

  __device__ void put(u32 at, const SnapshotBox& b, const FeatureNumbers& n) {
    bound[0][at] = {b.low[0], b.low[1], b.low[2], b.low[3]};
    bound[1][at] = {b.low[4], b.low[5], b.high[0], b.high[1]};
    bound[2][at] = {b.high[2], b.high[3], b.high[4], b.high[5]};
    numbers[at] = {n.vertex[0], n.vertex[1], n.vertex[2], n.number};
  }
  __device__ SnapshotBox box(u32 at) const {
    const float4 a = bound[0][at], b = bound[1][at], c = bound[2][at];
    return {{a.x, a.y, a.z, a.w, b.x, b.y}, {b.z, b.w, c.x, c.y, c.z, c.w}};
  }
  __device__ FeatureNumbers numbers_of(u32 at) const {
    const uint4 n = numbers[at];
    return {{n.x, n.y, n.z}, n.w};
  }
};

// Corners of the current leaf; tags: the vertices.
struct StagedCorners {
  Bound axes[LeafOrder::most_corners], slanted[LeafOrder::most_corners];

  __device__ static Bound load(const Bound& b) { return bound_of(*reinterpret_cast<const float4*>(&b)); }
  // Bounds and numbers of a feature.
  __device__ __forceinline__ void bounds_of(const LeafFeature& f, bool is_vertex, const SnapshotReach& reach,
                                            SnapshotBox& box, FeatureNumbers& numbers) const {
    for (u32 k = 0; k < 3; ++k) {
      const u32 c = f.corners >> 8 * k & 0xFF;
      const Bound at = load(axes[c]);
      const SnapshotPoint p = snapshot_point(at, load(slanted[c]));
      if (k == 0)
        box = SnapshotBox::of(p);
      else
        box.include(p);
      numbers.vertex[k] = at.tag;
    }
    box.grow(reach);
    numbers.number = is_vertex ? numbers.vertex[0] : f.number;
  }
};

struct NearLeaves {
  StagedFeatures first, second;  // all features of the first leaf; of the second one those that overlap the first
  unsigned char near[LeafOrder::most];  // features of the first leaf that overlap the second
  StagedCorners corners;
  uint2 waiting[96];  // candidates
};

// The vertex of the lane's corner, and its position. Depends only on the leaf.
template <class T>
__device__ __forceinline__ u32 lane_corner(const LaunchParams<T>& params, const DeviceLeaf& l, u32 world) {
  if (lane_number() >= l.n_corners()) return 0;
  return world * params.n_vertices + __ldg(params.corners + l.first_corner + lane_number());
}

// All lanes must call.
template <class T>
__device__ __forceinline__ SnapshotReach stage_corners(const LaunchParams<T>& params, StagedCorners& s,
                                                       const DeviceLeaf& l, u32 corner) {
  SnapshotReach reach{0, 0};
  if (lane_number() < l.n_corners()) {
    const float4* at = reinterpret_cast<const float4*>(params.points + corner);
    Bound axes = bound_of(__ldg(at)), slanted = bound_of(__ldg(at + 1));
    reach = {__uint_as_float(axes.tag), __uint_as_float(slanted.tag)};
    axes.tag = corner;
    store(&s.axes[lane_number()], axes);
    store(&s.slanted[lane_number()], slanted);
  }
  __syncwarp();
  if (params.thickness.of_vertex)  // the largest of the leaf: one for each corner would cost registers
    for (int d = 16; d > 0; d /= 2) {
      reach.axes = fmaxf(reach.axes, __shfl_xor_sync(all_lanes, reach.axes, d));
      reach.slanted = fmaxf(reach.slanted, __shfl_xor_sync(all_lanes, reach.slanted, d));
    }
  return {__shfl_sync(all_lanes, reach.axes, 0), __shfl_sync(all_lanes, reach.slanted, 0)};
}

// Numbers of a leaf's features that overlap the other leaf; they are stored consecutively in the leaf's order.
struct NearCounts {
  u32 edges = 0, faces = 0, vertices = 0;

  __device__ u32 all() const { return edges + faces + vertices; }
  // Counts the lanes' features by their order; returns the position of the lane's feature. All lanes must call.
  __device__ u32 add(const LeafOrder& order, u32 i, bool near) {
    const u32 mask = __ballot_sync(all_lanes, near), at = all() + __popc(mask & ((1u << lane_number()) - 1));
    const u32 n_edges = __popc(__ballot_sync(all_lanes, near && order.is_edge(i))),
              n_vertices = __popc(__ballot_sync(all_lanes, near && order.is_vertex(i)));
    edges += n_edges, vertices += n_vertices, faces += __popc(mask) - n_edges - n_vertices;
    return at;
  }
};

}  // namespace hpccd::gpu
