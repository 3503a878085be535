// SPDX-License-Identifier: Apache-2.0
// Edge-face tests in the snapshot at t = 0, on a batch of candidate pairs in the lanes of one instruction set. Results
// are bit-identical for all instruction sets.
#pragma once

#include "elementary/batch.h"

namespace hpccd {

// The vertices of an edge and a face: q[0], q[1] and q[2], q[3], q[4] of exact/intersection.h.
HPCCD_HD void edge_face_vertices(const Geometry& g, std::uint32_t edge, std::uint32_t face, std::uint32_t v[5]) {
  // Not through std::array (batch.h).
  const auto* e = reinterpret_cast<const std::uint32_t*>(g.edges + edge);
  const auto* f = reinterpret_cast<const std::uint32_t*>(g.faces + face);
  v[0] = e[0], v[1] = e[1], v[2] = f[0], v[3] = f[1], v[4] = f[2];
}

inline void edge_face_positions(const Geometry& g, std::uint32_t edge, std::uint32_t face, Vec3<double> q[5]) {
  std::uint32_t v[5];
  edge_face_vertices(g, edge, face, v);
  for (int i = 0; i < 5; ++i) q[i] = {g.vertices[v[i]].t0[0], g.vertices[v[i]].t0[1], g.vertices[v[i]].t0[2]};
}

// n <= batch_capacity. Results: `contact` has the positions of pairs that certainly intersect, `undecided` those of
// pairs left to integers, both ascending; there are no times. Counts: `coplanarity` are pairs rejected by signs of
// volumes, `projection` pairs that are apart in a projection.
using IntersectionBatch = void (*)(const Geometry&, const std::uint32_t* edge, const std::uint32_t* face,
                                   std::uint32_t n, BatchResult&);

// `simd` must not be Simd::automatic.
IntersectionBatch intersection_batch(Simd simd);

}  // namespace hpccd
