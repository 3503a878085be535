// SPDX-License-Identifier: Apache-2.0
#include "contacts/gaps.h"

#include <cmath>
#include <utility>

#include "contacts/nearest_points.h"
#include "elementary/inside.h"
#include "elementary/intersection_batch.h"

namespace hpccd {
namespace {

using V = Vec3<double>;

std::array<double, 3> row(const V& v) { return {v.x, v.y, v.z}; }

// Where an edge meets a face: where it passes through the plane, or where it touches an edge or the face's inside.
V meeting_point(const V q[5]) {
  const V a = q[3] - q[2], b = q[4] - q[2], n = cross(a, b);
  const double before = dot(q[0] - q[2], n), after = dot(q[1] - q[2], n);
  if (before * after < 0) return interpolate(q[0], q[1], before / (before - after));
  NearestPoints best{INFINITY, q[0], q[0], {}};
  const auto keep = [&](Kind kind, const V& q0, const V& q1, const V& q2, const V& q3) {
    const NearestPoints found = nearest_points({kind, {q0, q1, q2, q3}, {q0, q1, q2, q3}, 0}, 0);
    if (found.distance < best.distance) best = found;
  };
  keep(Kind::vertex_face, q[0], q[2], q[3], q[4]);
  keep(Kind::vertex_face, q[1], q[2], q[3], q[4]);
  for (int i = 2; i < 5; ++i) keep(Kind::edge_edge, q[0], q[1], q[i], q[i < 4 ? i + 1 : 2]);
  return best.on_first;
}

Gap gap_of(std::uint32_t mesh_a, std::uint32_t mesh_b, const NearestPair& found, const Geometry& g) {
  Gap gap{mesh_a, mesh_b};
  if (!(found.distance < INFINITY)) return gap;
  gap.distance = found.distance;
  if (found.kind == Kind::edge_face) {
    gap.kind = GapKind::edge_face;
    gap.features = {g.edges[found.first][0], g.edges[found.first][1], found.second};
    V q[5];
    edge_face_positions(g, found.first, found.second, q);
    gap.points[0] = gap.points[1] = row(meeting_point(q));
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
  const NearestPoints points = nearest_points(undecided_pair(g, {found.first, found.second, found.kind}), 0);
  gap.points = {row(points.on_first), row(points.on_second)};
  return gap;
}

}  // namespace

std::vector<Gap> collect_gaps(const Scene& scene, const PairRules& rules, const NearestPairs& nearest,
                              const Geometry& geometry) {
  std::vector<Gap> gaps;
  const auto n = static_cast<std::uint32_t>(scene.meshes().size());
  for (std::uint32_t a = 0; a < n; ++a)
    for (std::uint32_t b = a; b < n; ++b)
      if (rules.enabled(a, b)) gaps.push_back(gap_of(a, b, nearest.found(a, b), geometry));
  return gaps;
}

}  // namespace hpccd
