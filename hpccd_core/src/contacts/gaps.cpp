// SPDX-License-Identifier: Apache-2.0
#include "contacts/gaps.h"

#include <algorithm>
#include <cmath>

#include "contacts/intersection_place.h"
#include "contacts/places.h"
#include "elementary/intersection_batch.h"
#include "elementary/undecided.h"

namespace hpccd {
namespace {

using V = Vec3<double>;

std::array<double, 3> point_of(const V& v) { return {v.x, v.y, v.z}; }

// Of two edges, one or both may be points: a point is the first side.
void name_points(Gap& gap) {
  const auto [a0, a1, b0, b1] = gap.features;
  if (a0 != a1 && b0 != b1) return;
  gap.kind = a0 == a1 && b0 == b1 ? GapKind::vertex_vertex : GapKind::vertex_edge;
  gap.features = a0 != a1   ? std::array{b0, a0, a1, 0u}
                 : b0 == b1 ? std::array{a0, b0, 0u, 0u}
                            : std::array{a0, b0, b1, 0u};
  if (a0 == a1) return;
  std::swap(gap.points[0], gap.points[1]);
  std::ranges::rotate(gap.vertices, gap.vertices.begin() + 2),
      std::ranges::rotate(gap.weights, gap.weights.begin() + 2);
  for (double& w : gap.weights) w = -w;
  for (double& x : gap.normal) x = -x;
}

void positions_of(const Geometry& g, const NearestPair& pair, V at[5]) {
  if (pair.kind == Kind::edge_face) return edge_face_positions(g, pair.first, pair.second, at);
  V other_end[4];
  pair_positions(g, pair.kind, pair.first, pair.second, at, other_end);
}

}  // namespace

Gap gap_of(std::array<std::uint32_t, 2> meshes, const NearestPair& found, const Vec3<double> at[5], const Geometry& g) {
  Gap gap{meshes[0], meshes[1]};
  if (!(found.distance < INFINITY)) return gap;
  gap.distance = found.without_thickness;
  if (found.kind == Kind::edge_face) {
    gap.kind = GapKind::edge_face;
    gap.features = {g.edges[found.first][0], g.edges[found.first][1], found.second};
    const std::array<double, 3> point = point_of(point_on_edge(at, intersection_place(at)));
    gap.points = {point, point};
    return gap;
  }
  if (found.kind == Kind::vertex_face) {
    gap.kind = GapKind::vertex_face;
    gap.features = {found.first, found.second};
  } else {
    const auto &a = g.edges[found.first], &b = g.edges[found.second];
    gap.kind = GapKind::edge_edge;
    gap.features = {a[0], a[1], b[0], b[1]};
  }
  constexpr Outputs wanted{false, true, true, true, AtTime::start};
  UndecidedPair pair{found.kind, {}, {}, g.separations.thickness_of(found.kind, found.first, found.second)};
  std::copy_n(at, 4, pair.t0), std::copy_n(at, 4, pair.t1);
  const PairPlaces places = pair_places(pair, 0, wanted);
  gap.points = {point_of(places.closest[0]), point_of(places.closest[1])};
  pair_vertices(g, found.kind, found.first, found.second, gap.vertices.data());
  std::ranges::copy(places.weights, gap.weights.begin());
  gap.normal = point_of(places.normal);
  if (found.kind == Kind::edge_edge) name_points(gap);
  return gap;
}

std::vector<Gap> collect_gaps(const NearestPairs& nearest, const Geometry& geometry, const Cancellation& cancellation) {
  const MeshPairs& pairs = nearest.pairs();
  std::vector<Gap> gaps;
  gaps.reserve(pairs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    cancellation.heed();
    const NearestPair& found = nearest.found(i);
    V at[5];
    if (found.distance < INFINITY) positions_of(geometry, found, at);
    gaps.push_back(gap_of(pairs[i], found, at, geometry));
  }
  return gaps;
}

}  // namespace hpccd
