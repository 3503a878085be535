// SPDX-License-Identifier: Apache-2.0
// Branch and bound from pairs of whole meshes down to pairs of leaves (traverse/nearest_pairs.h): all pairs of nodes of
// one level at a time, of all pairs of meshes and all worlds. The last frame's nearest pairs give the first bounds.
#pragma once

#include "gpu/nearest_tests.cuh"

namespace hpccd::gpu {

// Of the map of a world's coordinates. sums: a bound on the rounding errors of sums of two coordinates.
struct WorldScale {
  double scale, sums;
};

// The search reads boxes, bounds of corners, positions (nearest_tests.cuh) and the scale of a world with these
// functions only. Meshes at poses have their own (placed_params.cuh).
template <class T>
__device__ inline DeviceBox box_of_node(const LaunchParams<T>& params, u32 world, u32 node) {
  return load_box(&params.node_boxes[static_cast<u64>(world) * params.n_nodes + node]);
}
template <class T>
__device__ inline DeviceBox box_of_leaf(const LaunchParams<T>& params, u32 world, u32 leaf) {
  return load_box(&params.leaf_boxes[world * params.n_leaves + leaf]);
}
// `vertex` is numbered through all worlds.
template <class T>
__device__ inline DevicePoint bounds_of_corner(const LaunchParams<T>& params, u32 vertex) {
  const float4* at = reinterpret_cast<const float4*>(params.points + vertex);
  return {{bound_of(__ldg(at)), bound_of(__ldg(at + 1))}};
}
template <class T>
__device__ inline WorldScale scale_of_world(const LaunchParams<T>& params, u32 world) {
  const SceneExtent extent(params.worlds[world]);
  return {extent.map().scale, 2e-15 * extent.largest()};
}

__device__ inline float square_of_gap(const DeviceBox& a, const DeviceBox& b) {
  float s = 0;
  for (int k = 0; k < 3; ++k) {
    const float gap = fmaxf(fmaxf(a.low[0].x[k] - b.high[0].x[k], b.low[0].x[k] - a.high[0].x[k]), 0.0f);
    s += gap * gap;
  }
  return s;
}

__device__ inline float square_of_farthest(const DeviceBox& a, const DeviceBox& b) {
  float s = 0;
  for (int k = 0; k < 3; ++k) {
    const float d = fmaxf(a.high[0].x[k] - b.low[0].x[k], b.high[0].x[k] - a.low[0].x[k]);
    s += d * d;
  }
  return s;
}

// At most `reach` apart along every axis and slanted direction (Node::near_in_snapshot).
__device__ inline bool near_in_snapshot(const DeviceBox& a, const DeviceBox& b, float reach) {
  const float slanted = slanted_reach(reach);
  bool apart = false;
  for (int end = 0; end < 2; ++end)
    for (int k = 0; k < 3; ++k) {
      const float by = end ? slanted : reach;
      apart |= (a.high[end].x[k] + by < b.low[end].x[k]) | (b.high[end].x[k] + by < a.low[end].x[k]);
    }
  return !apart;
}

__device__ inline bool within_reach(const DeviceBox& a, const DeviceBox& b, float reach) {
  return near_in_snapshot(a, b, reach) && !(square_of_gap(a, b) > reach * reach);
}

// Whether two nodes may contain a pair that improves the result; the nodes themselves may improve the limit.
template <class T>
__device__ __forceinline__ bool may_improve(const LaunchParams<T>& params, const NearestTask& task, u32 of, u32 a,
                                            u32 b) {
  const NodeContent in_a = task.contents[a], in_b = task.contents[b];
  if (!NodeContent::tested(in_a.kinds, in_b.kinds)) return false;
  NearestSoFar& s = task.so_far[of];
  const u32 world = of / task.n_pairs;
  const SearchedMeshes& meshes = task.meshes[of - world * task.n_pairs];
  const DeviceBox box_a = box_of_node(params, world, a), box_b = box_of_node(params, world, b);
  if (const u64 intersecting = fresh(&s.intersecting); intersecting != no_pair)
    return min(in_a.least_edge, in_b.least_edge) <= intersecting >> 32 && (a == b || near_in_snapshot(box_a, box_b, 0));
  if (a == b) return true;
  if (meshes.bounded) lower_limit_by_box(s, meshes.most_lack, square_of_farthest(box_a, box_b));
  return within_reach(box_a, box_b, reach_of(s, limit_of(s)));
}

// Keeps the lane's pair of nodes for the given level, or as a pair of leaves. All lanes must call.
template <class T>
__device__ __forceinline__ void keep_nodes(const LaunchParams<T>& params, const NearestTask& task, bool wanted, u32 of,
                                           u32 a, u32 b, u32 level) {
  uint2 link_a{0, 0}, link_b{0, 0};
  if (wanted) link_a = params.node_links[a], link_b = params.node_links[b];
  const bool leaves = wanted && link_a.x == 0 && link_b.x == 0, nodes = wanted && !leaves;
  const u64 at_leaf = warp_append(&task.counters->leaves, leaves),
            at_node = warp_append(&task.counters->nodes[level], nodes);
  if (leaves && at_leaf < task.leaf_capacity) task.leaves[at_leaf] = {link_a.y, link_b.y, of, 0};
  if (nodes && at_node < task.node_capacity) task.nodes[level & 1][at_node] = {a, b, of, 0};
}

// An edge and a face that do not intersect any more: the ends of the edge are near the face.
template <class T>
__device__ inline void bound_by_ends(const LaunchParams<T>& params, const NearestTask& task, u32 of, uint2 pair) {
  const u32 world = of / task.n_pairs;
  const uint2 edge = __ldg(params.edges + pair.x);
  NearestSoFar& s = task.so_far[of];
  for (const u32 end : {edge.x, edge.y}) {
    if (params.filtered && params.filter.vertex_face(end, pair.y)) continue;
    const Nearness n = nearness<Kind::vertex_face>(params, world, {end, pair.y}, 1e307);
    if (n.outcome != Outcome::yes) continue;
    const double distance = n.distance + task.meshes[of - world * task.n_pairs].most_lack;
    lower_limit(s, distance * (1 + 1e-14) + 2 * s.rounding);
  }
}

// The last frame's nearest pair, at the positions of this frame.
template <class T>
__device__ inline void begin_with_last(const LaunchParams<T>& params, const NearestTask& task, u32 of, u64 key,
                                       u64 intersecting) {
  NearestSoFar& s = task.so_far[of];
  const u32 world = of / task.n_pairs;
  if (intersecting != no_pair) {
    const uint2 pair{static_cast<u32>(intersecting >> 32), static_cast<u32>(intersecting)};
    if (intersection_of(params, world, pair) == Outcome::yes)
      s.intersecting = intersecting;
    else
      bound_by_ends(params, task, of, pair);
  }
  if (key == no_pair) return;
  const bool edges = key >> 62 & 1;
  const uint2 pair{static_cast<u32>(key >> 31) & ~kind_bit, static_cast<u32>(key) & ~kind_bit};
  const Nearness n = edges ? nearness<Kind::edge_edge>(params, world, pair, 1e307)
                           : nearness<Kind::vertex_face>(params, world, pair, 1e307);
  if (n.outcome != Outcome::yes) return;
  double lack = 0;
  if (task.thickness.of_vertex)
    lack = task.meshes[of - world * task.n_pairs].thickest -
           thickness_of(task.thickness, edges ? Kind::edge_edge : Kind::vertex_face, pair);
  s.distance = bits_of(n.distance + lack), s.key = key, s.without_thickness = n.distance;
  lower_limit(s, (n.distance + lack) * (1 + 1e-14) + s.rounding);
}

template <class T>
__global__ void begin_nearest_kernel(const __grid_constant__ LaunchParams<T> params,
                                     const __grid_constant__ NearestTask task) {
  const u32 of = blockIdx.x * blockDim.x + threadIdx.x, world = of / task.n_pairs;
  if (params.counters->bad != 0) return;
  const bool valid = of < task.n_all;
  SearchedMeshes meshes{};
  if (valid) {
    meshes = task.meshes[of - world * task.n_pairs];
    NearestSoFar& s = task.so_far[of];
    const u64 key = s.key, intersecting = s.intersecting;
    const WorldScale at = scale_of_world(params, world);
    // For a pair as large as the scene, as in traverse/nearest_pairs.cpp.
    constexpr double test_rounding = distance_radius + 1e-14;
    s = {bits_of(1e307),
         bits_of(INFINITY),
         no_pair,
         no_pair,
         INFINITY,
         at.scale,
         at.sums,
         14 * test_rounding / at.scale,
         0};
    if (meshes.root_a != no_node && meshes.root_b != no_node) begin_with_last(params, task, of, key, intersecting);
  }
  const bool searched = valid && meshes.root_a != no_node && meshes.root_b != no_node;
  keep_nodes(params, task, searched && may_improve(params, task, of, meshes.root_a, meshes.root_b), of, meshes.root_a,
             meshes.root_b, 0);
  if (!searched || !meshes.same || task.so_far[of].key != no_pair || task.so_far[of].intersecting != no_pair) return;
  const u32 n = min(meshes.n_leaves, samples_of_mesh);
  const u64 at = atomicAdd(&task.counters->samples, u64{2} * n);
  for (u32 i = 0; i < n && at + 2 * i + 1 < task.sample_capacity; ++i) {
    const u32 own = static_cast<u32>(static_cast<u64>(i) * meshes.n_leaves / n), other = meshes.n_leaves - 1 - own;
    const u32 leaf = meshes.first_leaf + own;
    task.samples[at + 2 * i] = {leaf, leaf, of, 0};
    task.samples[at + 2 * i + 1] = {meshes.first_leaf + min(own, other), meshes.first_leaf + max(own, other), of, 0};
  }
}

// One lane for each pair of children: both nodes are split, and a node with itself into both children with themselves
// and with each other.
template <class T>
__global__ __launch_bounds__(128) void nearest_nodes_kernel(const __grid_constant__ LaunchParams<T> params,
                                                            const __grid_constant__ NearestTask task, u32 level) {
  const u64 n = 4 * length(task.counters->nodes[level], task.node_capacity);
  const u64 first = static_cast<u64>(blockIdx.x) * blockDim.x + threadIdx.x,
            stride = static_cast<u64>(gridDim.x) * blockDim.x;
#pragma unroll 1
  for (u64 i = first; i - lane_number() < n; i += stride) {
    const u32 right_a = i & 1, right_b = i >> 1 & 1;
    bool exists = i < n;
    u32 a = 0, b = 0, of = 0;
    if (exists) {
      const uint4 pair = task.nodes[level & 1][i / 4];
      const u32 left_a = params.node_links[pair.x].x, left_b = params.node_links[pair.y].x;
      exists = (left_a || !right_a) && (left_b || !right_b) && !(pair.x == pair.y && right_a && !right_b);
      a = left_a ? left_a + right_a : pair.x, b = left_b ? left_b + right_b : pair.y, of = pair.z;
    }
    keep_nodes(params, task, exists && may_improve(params, task, of, a, b), of, a, b, level + 1);
  }
}

// The results, and the positions of their features.
template <class T>
__device__ inline PairOfFeatures features_of(const LaunchParams<T>& params, u32 world, Kind kind, uint2 pair) {
  PairOfFeatures r;
  r.first = pair.x, r.second = pair.y, r.kind = kind;
  positions_of(params, world, kind, pair, r.at);
  return r;
}

__device__ inline bool lies_within(const DeviceBox& a, const DeviceBox& b) {
  bool within = true;
  for (int k = 0; k < 3; ++k) within &= b.low[0].x[k] <= a.low[0].x[k] && a.high[0].x[k] <= b.high[0].x[k];
  return within;
}

template <class T>
__global__ void nearest_results_kernel(const __grid_constant__ LaunchParams<T> params,
                                       const __grid_constant__ NearestTask task) {
  const u32 i = blockIdx.x * blockDim.x + threadIdx.x;
  if (params.counters->bad != 0) return;
  if (i < task.n_all) {
    const NearestSoFar& s = task.so_far[i];
    const u32 world = i / task.n_pairs;
    const SearchedMeshes meshes = task.meshes[i - world * task.n_pairs];
    NearestOfMeshes r;
    r.found = s.intersecting != no_pair || s.key != no_pair;
    r.distance = r.without_thickness = 0;
    r.limit = double_of(s.limit);
    if (s.intersecting != no_pair) {
      r.pair = features_of(params, world, Kind::edge_face,
                           {static_cast<u32>(s.intersecting >> 32), static_cast<u32>(s.intersecting)});
    } else if (r.found) {
      r.pair = features_of(params, world, s.key >> 62 ? Kind::edge_edge : Kind::vertex_face,
                           {static_cast<u32>(s.key >> 31) & ~kind_bit, static_cast<u32>(s.key) & ~kind_bit});
      r.distance = double_of(s.distance), r.without_thickness = s.without_thickness;
    }
    r.boxes_meet = r.a_within_b = r.b_within_a = false;
    if (!meshes.same && meshes.root_a != no_node && meshes.root_b != no_node) {
      const DeviceBox a = box_of_node(params, world, meshes.root_a), b = box_of_node(params, world, meshes.root_b);
      r.boxes_meet = near_in_snapshot(a, b, 0), r.a_within_b = lies_within(a, b), r.b_within_a = lies_within(b, a);
    }
    task.results[i] = r;
  }
  const u64 n = length(task.counters->undecided, task.undecided_capacity);
  for (u64 k = i; k < n; k += static_cast<u64>(gridDim.x) * blockDim.x) {
    const uint4 u = task.undecided[k];
    task.undecided_results[k] = {u.x, features_of(params, u.x / task.n_pairs, static_cast<Kind>(u.y), {u.z, u.w})};
  }
}

}  // namespace hpccd::gpu
