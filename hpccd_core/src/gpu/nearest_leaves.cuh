// SPDX-License-Identifier: Apache-2.0
// Pairs of leaves in the search for the nearest features: one warp each. Candidates wait in shared memory until a warp
// is full of them, and are tested at once, so that each result shortens the remaining search.
#pragma once

#include "gpu/near_candidates.cuh"
#include "gpu/nearest_nodes.cuh"

namespace hpccd::gpu {

inline constexpr u32 nearest_warps = 4;

// Candidates of one kind that wait for the test.
struct WaitingPairs {
  static constexpr u32 room = 64;
  uint2 pairs[room];
  u32 of[room];
};

// Features of a leaf. Their bounds along the axes reject most pairs, so that the other words are rarely read.
struct NearestFeatures {
  float4 low[LeafOrder::most], high[LeafOrder::most], slanted_low[LeafOrder::most], slanted_high[LeafOrder::most];

  __device__ void put(u32 at, const SnapshotBox& b, const FeatureNumbers& n) {
    low[at] = {b.low[0], b.low[1], b.low[2], __uint_as_float(n.vertex[0])};
    high[at] = {b.high[0], b.high[1], b.high[2], __uint_as_float(n.vertex[1])};
    slanted_low[at] = {b.low[3], b.low[4], b.low[5], __uint_as_float(n.vertex[2])};
    slanted_high[at] = {b.high[3], b.high[4], b.high[5], __uint_as_float(n.number)};
  }
};

__device__ inline float3 gaps_of(float4 low_a, float4 high_a, float4 low_b, float4 high_b) {
  return {fmaxf(low_b.x - high_a.x, low_a.x - high_b.x), fmaxf(low_b.y - high_a.y, low_a.y - high_b.y),
          fmaxf(low_b.z - high_a.z, low_a.z - high_b.z)};
}
__device__ inline float positive_square(float x) { return x > 0 ? x * x : 0; }

struct NearestSpace {
  NearestFeatures side[2];  // the features of each leaf that are near the other leaf
  StagedCorners corners;
  WaitingPairs waiting[3];  // by kind
};

// What other warps change, the same for all lanes. All lanes must call.
__device__ inline u64 fresh_for_warp(const u64* at) { return __shfl_sync(all_lanes, fresh(at), 0); }
__device__ inline float reach_for_warp(const NearestSoFar& s) {
  return reach_of(s, double_of(fresh_for_warp(&s.limit)));
}

inline constexpr u32 no_edge = 0xFFFFFFFFu;

__device__ inline SnapshotBox snapshot_box(const DeviceBox& b) {
  SnapshotBox r;
  for (int k = 0; k < 6; ++k) r.low[k] = b.low[k / 3].x[k % 3], r.high[k] = b.high[k / 3].x[k % 3];
  return r;
}

__device__ inline bool within_reach(const SnapshotBox& a, const SnapshotBox& b, float reach) {
  const float slanted = slanted_reach(reach);
  bool apart = false;
  float square = 0;
  for (int k = 0; k < 6; ++k) {
    const float gap = fmaxf(b.low[k] - a.high[k], a.low[k] - b.high[k]);
    apart |= gap > (k < 3 ? reach : slanted);
    if (k < 3) square += gap > 0 ? gap * gap : 0;
  }
  return !apart && !(square > reach * reach);
}

// One leaf of a pair: its features, and the lane's corner.
struct SearchedLeaf {
  DeviceLeaf leaf;
  u32 corner;
  Bound axes, slanted;

  template <class T>
  __device__ SearchedLeaf(const LaunchParams<T>& params, u32 number, u32 world) : leaf(params.leaves[number]) {
    corner = lane_corner(params, leaf, world);
    const DevicePoint at = bounds_of_corner(params, corner);
    axes = at.at[0], slanted = at.at[1];
    axes.tag = corner;
  }
  __device__ bool has_corner() const { return lane_number() < leaf.n_corners(); }
};

// Farther apart along the direction between the centres of their boxes: boxes of slanted leaves are larger than the
// leaves by nearly their own size. Coordinates are within 2.25, a dot product has a rounding error of at most 1.5e-6.
__device__ inline bool farther_apart(const SearchedLeaf& a, const SearchedLeaf& b, const DeviceBox& box_a,
                                     const DeviceBox& box_b, float reach) {
  float u[3], square = 0;
  for (int k = 0; k < 3; ++k) {
    u[k] = (box_b.low[0].x[k] - box_a.low[0].x[k]) + (box_b.high[0].x[k] - box_a.high[0].x[k]);
    square += u[k] * u[k];
  }
  if (!(square > 1e-20f)) return false;
  const float to_unit = rsqrtf(square);
  float most = -INFINITY, least = INFINITY;
  for (int k = 0; k < 3; ++k) u[k] *= to_unit;
  if (a.has_corner()) most = u[0] * a.axes.x[0] + u[1] * a.axes.x[1] + u[2] * a.axes.x[2];
  if (b.has_corner()) least = u[0] * b.axes.x[0] + u[1] * b.axes.x[1] + u[2] * b.axes.x[2];
  for (int d = 16; d > 0; d /= 2) {
    most = fmaxf(most, __shfl_xor_sync(all_lanes, most, d));
    least = fminf(least, __shfl_xor_sync(all_lanes, least, d));
  }
  return least - most > reach * (1 + 1e-5f) + 4e-6f;
}

// The square of the smallest distance of two corners.
__device__ inline float square_of_corners(const SearchedLeaf& a, const SearchedLeaf& b) {
  float least = INFINITY;
#pragma unroll 1
  for (u32 i = 0; i < b.leaf.n_corners(); ++i) {
    float square = 0;
    for (int k = 0; k < 3; ++k) {
      const float d = a.axes.x[k] - __shfl_sync(all_lanes, b.axes.x[k], i);
      square += d * d;
    }
    if (a.has_corner()) least = fminf(least, square);
  }
  for (int d = 16; d > 0; d /= 2) least = fminf(least, __shfl_xor_sync(all_lanes, least, d));
  return least;
}

// The features of a leaf within reach of a box, in the order of leaves; edges up to a number only.
template <class T>
__device__ __forceinline__ NearCounts stage_near(const LaunchParams<T>& params, NearestSpace& s, u32 side,
                                                 const SearchedLeaf& l, const SnapshotBox& other, bool all, float reach,
                                                 u32 last_edge) {
  __syncwarp();
  if (l.has_corner())
    store(&s.corners.axes[lane_number()], l.axes), store(&s.corners.slanted[lane_number()], l.slanted);
  __syncwarp();
  const LeafOrder order(l.leaf);
  NearCounts n;
#pragma unroll 1
  for (u32 base = 0; base < order.n; base += 32) {
    const u32 i = base + lane_number();
    SnapshotBox box;
    FeatureNumbers numbers;
    bool near = i < order.n;
    if (near) {
      s.corners.bounds_of(feature_at(params, l.leaf, i), order.is_vertex(i), {0, 0}, box, numbers);
      near = (all || within_reach(box, other, reach)) && !(order.is_edge(i) && numbers.number > last_edge);
    }
    const u32 at = n.add(order, i, near);
    if (near) s.side[side].put(at, box, numbers);
  }
  return n;
}

// Edge and face of different leaves, or of one, by their vertices: for an edge the third repeats the second.
__device__ inline bool share_a_vertex(const FeatureNumbers& a, const FeatureNumbers& b) {
  bool shared = false;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) shared |= a.vertex[i] == b.vertex[j];
  return shared;
}

template <class T>
struct NearestOfLeaves {
  const LaunchParams<T>& params;
  const NearestTask& task;
  NearestSpace& s;
  u32 n_waiting = 0;  // eight bits by kind: an array with a variable index would lie in memory
  u32 tests = 0;

  __device__ u32 waiting(u32 k) const { return n_waiting >> 8 * k & 0xFF; }

  // A warp of the candidates of one kind that wait, or all of fewer.
  __device__ __forceinline__ void test(u32 k) {
    const u32 now = min(waiting(k), 32u), rest = waiting(k) - now;
    const bool valid = lane_number() < now;
    const uint2 pair = valid ? s.waiting[k].pairs[rest + lane_number()] : uint2{0, 0};
    const u32 of = valid ? s.waiting[k].of[rest + lane_number()] : 0;
    __syncwarp();
    n_waiting -= now << 8 * k, tests += now;
    if (k == static_cast<u32>(Kind::edge_face)) test_intersection(params, task, valid, pair, of);
    if (k == static_cast<u32>(Kind::edge_edge)) test_nearest<Kind::edge_edge>(params, task, valid, pair, of);
    if (k == static_cast<u32>(Kind::vertex_face)) test_nearest<Kind::vertex_face>(params, task, valid, pair, of);
    __syncwarp();
  }

  // The lane's candidate: in side x the i-th staged feature, in side y the j-th.
  __device__ __forceinline__ bool candidate(Kind kind, u32 x, u32 i, u32 y, u32 j, float reach, u32 world,
                                            uint2& pair) const {
    const NearestFeatures &a = s.side[x], &b = s.side[y];
    const float4 low_a = a.low[i], high_a = a.high[i], low_b = b.low[j], high_b = b.high[j];
    const float3 along = gaps_of(low_a, high_a, low_b, high_b);
    const float square = positive_square(along.x) + positive_square(along.y) + positive_square(along.z);
    if (square > reach * reach) return false;
    const float4 slanted_a = a.slanted_low[i], end_a = a.slanted_high[i], slanted_b = b.slanted_low[j],
                 end_b = b.slanted_high[j];
    const float3 slanted = gaps_of(slanted_a, end_a, slanted_b, end_b);
    if (fmaxf(fmaxf(slanted.x, slanted.y), slanted.z) > slanted_reach(reach)) return false;
    const auto vertices = [](float4 low, float4 high, float4 other) {
      return FeatureNumbers{{__float_as_uint(low.w), __float_as_uint(high.w), __float_as_uint(other.w)}, 0};
    };
    if (share_a_vertex(vertices(low_a, high_a, slanted_a), vertices(low_b, high_b, slanted_b))) return false;
    pair = {__float_as_uint(end_a.w), __float_as_uint(end_b.w)};
    if (kind == Kind::vertex_face) pair.x -= world * params.n_vertices;  // the number of a vertex is that of all worlds
    if (kind == Kind::edge_edge && pair.y < pair.x) pair = {pair.y, pair.x};
    if (params.edge_kinds) {
      if (kind == Kind::edge_face && params.edge_kinds[pair.x] == EdgeKind::point) return false;
      if (kind == Kind::edge_edge && never_paired(params.edge_kinds[pair.x], params.edge_kinds[pair.y])) return false;
    }
    return true;
  }

  __device__ bool ignored(Kind kind, uint2 pair) const {
    return kind == Kind::edge_face   ? params.filter.edge_face(pair.x, pair.y)
           : kind == Kind::edge_edge ? params.filter.edge_edge(pair.x, pair.y)
                                     : params.filter.vertex_face(pair.x, pair.y);
  }

  // Pairs of one kind between staged features: of sides x and y.
  struct Product {
    Kind kind;
    u32 x, y;
    NearProduct pairs;
  };

  // The i-th of five.
  __device__ __forceinline__ static Product product(u32 i, const NearCounts& a, const NearCounts& b, bool same) {
    const u32 y = same ? 0 : 1;
    switch (i) {
      case 0:
        return {Kind::edge_face, 0, y, NearProduct::of(0, a.edges, b.edges, b.faces)};
      case 1:
        return {Kind::edge_face, y, 0, NearProduct::of(0, same ? 0 : b.edges, a.edges, a.faces)};
      case 2:
        return {Kind::vertex_face, 0, y, NearProduct::of(a.edges + a.faces, a.vertices, b.edges, b.faces)};
      case 3:
        return {Kind::vertex_face, y, 0, NearProduct::of(b.edges + b.faces, same ? 0 : b.vertices, a.edges, a.faces)};
      default:
        return {Kind::edge_edge, 0, y, same ? edges_of_one_leaf(a.edges) : NearProduct::of(0, a.edges, 0, b.edges)};
    }
  }

  __device__ __forceinline__ void add(const Product& p, bool of_one_leaf, u32 n_one, float reach, u32 of, u32 world,
                                      bool filtered) {
    const u32 k = static_cast<u32>(p.kind);
#pragma unroll 1
    for (u32 base = 0; base < p.pairs.n_pairs; base += 32) {
      const u32 c = base + lane_number();
      uint2 at = p.pairs.pair(c);
      bool near = c < p.pairs.n_pairs;
      if (of_one_leaf) {
        at = two_of_one_leaf(at, p.pairs.width);
        near = near && at.x < n_one && at.y < n_one;
      }
      uint2 pair{0, 0};
      if (near) near = candidate(p.kind, p.x, p.pairs.first + at.x, p.y, p.pairs.second + at.y, reach, world, pair);
      if (near && filtered) near = !ignored(p.kind, pair);
      const u32 mask = __ballot_sync(all_lanes, near);
      if (near) {
        const u32 to = waiting(k) + __popc(mask & ((1u << lane_number()) - 1));
        s.waiting[k].pairs[to] = pair, s.waiting[k].of[to] = of;
      }
      n_waiting += __popc(mask) << 8 * k;
      if (waiting(k) < 32) continue;
      __syncwarp();
      test(k);
    }
  }

  __device__ __forceinline__ void search(uint4 pair) {
    const u32 of = pair.z, world = of / task.n_pairs;
    NearestSoFar& so_far = task.so_far[of];
    const bool same = pair.x == pair.y;
    const DeviceBox box_a = box_of_leaf(params, world, pair.x), box_b = box_of_leaf(params, world, pair.y);
    const NodeContent in_a = task.leaf_contents[pair.x], in_b = task.leaf_contents[pair.y];
    const SearchedLeaf a(params, pair.x, world), b(params, pair.y, world);
    const u64 intersecting = fresh_for_warp(&so_far.intersecting);
    float reach = reach_for_warp(so_far);
    const bool touching = same || near_in_snapshot(box_a, box_b, 0);
    u32 last_edge = no_edge;
    if (intersecting != no_pair) {
      last_edge = static_cast<u32>(intersecting >> 32), reach = 0;
      if (!touching || min(in_a.least_edge, in_b.least_edge) > last_edge) return;
    } else if (!same) {
      if (!within_reach(box_a, box_b, reach)) return;
      if (!touching && farther_apart(a, b, box_a, box_b, reach)) return;
      // Later pairs of features give a better bound.
      const SearchedMeshes& meshes = task.meshes[of - world * task.n_pairs];
      if (meshes.bounded && fresh_for_warp(&so_far.key) == no_pair &&
          !((in_a.kinds | in_b.kinds) & NodeContent::isolated_vertices)) {
        const float square = square_of_corners(a, b);
        if (lane_number() == 0) lower_limit_by_box(so_far, meshes.most_lack, square);
        __syncwarp();
        reach = reach_for_warp(so_far);
      }
    }
    const NearCounts of_a = stage_near(params, s, 0, a, snapshot_box(box_b), same, reach, last_edge);
    if (of_a.all() == 0) return;
    const NearCounts of_b = same ? of_a : stage_near(params, s, 1, b, snapshot_box(box_a), false, reach, last_edge);
    __syncwarp();
    const bool filtered = params.filtered && are_filtered(params, a.leaf, b.leaf);
#pragma unroll 1
    for (u32 i = touching ? 0 : 2; i < 5; ++i) {
      if (i == 2 && fresh_for_warp(&so_far.intersecting) != no_pair) return;
      add(product(i, of_a, of_b, same), same && i == 4, of_a.edges, i < 2 ? 0 : reach, of, world, filtered);
    }
  }
};

template <class T>
__global__ __launch_bounds__(32 * nearest_warps,
                             4) void nearest_leaves_kernel(const __grid_constant__ LaunchParams<T> params,
                                                           const __grid_constant__ NearestTask task, bool samples) {
  __shared__ NearestSpace spaces[nearest_warps];
  if (params.counters->bad != 0) return;
  NearestOfLeaves<T> search{params, task, spaces[threadIdx.x / 32]};
  const uint4* list = samples ? task.samples : task.leaves;
  const u64 n = samples ? length(task.counters->samples, task.sample_capacity)
                        : length(task.counters->leaves, task.leaf_capacity);
  const u64 n_warps = static_cast<u64>(gridDim.x) * nearest_warps;
#pragma unroll 1
  for (u64 i = static_cast<u64>(blockIdx.x) * nearest_warps + threadIdx.x / 32; i < n; i += n_warps)
    search.search(list[i]);
  __syncwarp();
  for (u32 k = 0; k < 3; ++k)
    if (search.waiting(k) > 0) search.test(k);
  if (lane_number() == 0 && search.tests) atomicAdd(&task.counters->tests, u64{search.tests});
}

}  // namespace hpccd::gpu
