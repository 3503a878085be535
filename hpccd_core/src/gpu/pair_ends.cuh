// SPDX-License-Identifier: Apache-2.0
// A pair at both ends of its motion, for the tests that need more than its spanning vectors.
#pragma once

#include "gpu/launch_params.cuh"

namespace hpccd::gpu {

// In the order of pair_vertices.
struct PairEnds {
  Vec3<double> t0[4], t1[4];
};

template <class T>
__device__ __forceinline__ PairEnds load_pair_ends(const GivenEnds<T>* vertices, uint4 v) {
  const Ends r[4] = {load_ends(vertices, v.x), load_ends(vertices, v.y), load_ends(vertices, v.z),
                     load_ends(vertices, v.w)};
  return {{r[0].t0, r[1].t0, r[2].t0, r[3].t0}, {r[0].t1, r[1].t1, r[2].t1, r[3].t1}};
}

template <class T>
__device__ __forceinline__ uint4 vertices_of(const LaunchParams<T>& params, const Candidate& pair) {
  return pair.kind == Kind::edge_edge ? vertices_of<Kind::edge_edge>(params, pair.first, pair.second)
                                      : vertices_of<Kind::vertex_face>(params, pair.first, pair.second);
}

}  // namespace hpccd::gpu
