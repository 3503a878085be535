// SPDX-License-Identifier: Apache-2.0
// Elementary tests on a batch of candidate pairs, in the lanes of one instruction set. Results are bit-identical for
// all instruction sets.
#pragma once

#include <cstdint>

#include "bvh/kdop.h"
#include "elementary/distance/separations.h"
#include "elementary/pair_vertices.h"
#include "hpccd/hpccd.h"
#include "scene/vertex_motion.h"

namespace hpccd {

struct Geometry {
  const VertexMotion* vertices;
  const std::array<std::uint32_t, 2>* edges;
  const std::array<std::uint32_t, 3>* faces;
  const VertexKdop* kdops = nullptr;       // of each vertex; null if pairs count that do not touch
  const RoundedMotion* rounded = nullptr;  // for single precision; null if floats are too coarse for the scene
  Separations separations = {};            // for tests of distances
  KdopMargin margin = {};                  // of the largest separation
  KdopMargin margin_of_none = {};          // of a separation of 0
  KdopMargin margin_of_one = {};           // of a separation of 1 / kdop_scale, above that of 0
  double kdop_scale = 0;                   // 0: the margin of the largest separation suits all pairs
  float until = 2;                         // below 1: pairs that cannot touch up to this time may be skipped
};

template <Kind kind>
HPCCD_HD void pair_vertices(const Geometry& g, std::uint32_t first, std::uint32_t second, std::uint32_t v[4]) {
  // Not through std::array, whose functions are compiled for one instruction set and linked for all (batch.inl).
  pair_vertices<kind>(reinterpret_cast<const std::uint32_t*>(g.edges), reinterpret_cast<const std::uint32_t*>(g.faces),
                      first, second, v);
}

inline void pair_vertices(const Geometry& g, Kind kind, std::uint32_t first, std::uint32_t second, std::uint32_t v[4]) {
  if (kind == Kind::vertex_face)
    pair_vertices<Kind::vertex_face>(g, first, second, v);
  else
    pair_vertices<Kind::edge_edge>(g, first, second, v);
}

// The positions of these vertices at both ends of the motion.
HPCCD_HD void pair_positions(const Geometry& g, Kind kind, std::uint32_t first, std::uint32_t second,
                             Vec3<double> t0[4], Vec3<double> t1[4]) {
  std::uint32_t v[4];
  pair_vertices(g, kind, first, second, v);
  for (int i = 0; i < 4; ++i) {
    const VertexMotion& m = g.vertices[v[i]];
    t0[i] = {m.t0[0], m.t0[1], m.t0[2]}, t1[i] = {m.t1[0], m.t1[1], m.t1[2]};
  }
}

// Large enough that the survivors of each filter still fill the lanes of the next, and small enough that the vertices
// and k-DOPs of a batch stay in a core's cache from one filter to the next.
inline constexpr std::uint32_t batch_capacity = 1024;

// Outcomes of the pairs of a batch; every pair has exactly one outcome.
struct BatchCounts {
  std::uint64_t tested = 0;       // pairs in the batch
  std::uint64_t kdop = 0;         // rejected by the k-DOP filter
  std::uint64_t coplanarity = 0;  // rejected by the sign test on the cubic
  std::uint64_t projection = 0;   // rejected because the vertex or edge stays outside in a projection
  std::uint64_t roots = 0;        // rejected at the roots of the cubic
  std::uint64_t separated =
      0;  // rejected because the features are farther apart than their separation along a direction
  std::uint64_t contacts = 0;    // proven contacts
  std::uint64_t undecided = 0;   // passed to the tier's fallback
  std::uint64_t kdop_ticks = 0;  // time of the k-DOP filter (base/ticks.h)

  BatchCounts& operator+=(const BatchCounts& c) {
    tested += c.tested, kdop += c.kdop, coplanarity += c.coplanarity, projection += c.projection;
    roots += c.roots, separated += c.separated, contacts += c.contacts, undecided += c.undecided;
    kdop_ticks += c.kdop_ticks;
    return *this;
  }
};

struct BatchResult {
  std::uint32_t n_contacts = 0, n_undecided = 0;
  std::uint32_t contact[batch_capacity];  // positions in the batch
  std::uint32_t undecided[batch_capacity];
  double toc[batch_capacity], delta[batch_capacity];
  BatchCounts counts;                  // accumulates over batches
  double apart_until[batch_capacity];  // for undecided pairs: see UndecidedPair; not for edges and faces
};

// first, second: vertex and face, or two edges. n <= batch_capacity.
using BatchTest = void (*)(const Geometry&, Kind, const std::uint32_t* first, const std::uint32_t* second,
                           std::uint32_t n, BatchResult&);

// `simd` must not be Simd::automatic. "fast" has a test of its own; the other tiers share one and differ in their
// fallback.
BatchTest batch_test(Simd simd, Accuracy accuracy);

}  // namespace hpccd
