// SPDX-License-Identifier: Apache-2.0
#include "contacts/gaps.h"

#include <cmath>
#include <utility>

#include "contacts/meeting_point.h"
#include "contacts/nearest_points.h"
#include "elementary/exact/distance.h"
#include "elementary/inside.h"
#include "elementary/intersection_batch.h"

namespace hpccd {
namespace {

using V = Vec3<double>;

std::array<double, 3> row(const V& v) { return {v.x, v.y, v.z}; }

// Where an edge meets a face: in the plane of the face, if that is known well enough; else at one of its ends, or where
// it meets an edge of the face.
exact::Nearest meeting_place(const V q[5]) {
  const V n = unit(cross(unit(q[3] - q[2]), unit(q[4] - q[2]))), from = q[0] - q[2], to = q[1] - q[2];
  const double size = std::max(largest(from), largest(to));
  const double before = dot(V{from.x / size, from.y / size, from.z / size}, n),
               after = dot(V{to.x / size, to.y / size, to.z / size}, n);
  const double place = before / (before - after);
  const double rounding = 1e-14 * size + 1e-15 * std::max(largest(q[0]), largest(q[1]));
  exact::Nearest best{INFINITY, q[0], q[0]};
  const auto keep = [&](Kind kind, const V& q0, const V& q1, const V& q2, const V& q3) {
    const V pair[4] = {q0, q1, q2, q3};
    const exact::Nearest found = exact::nearest(kind, pair);
    if (found.distance < best.distance) best = found;
  };
  const V point = interpolate(q[0], q[1], place);
  if (place >= 0 && place <= 1) keep(Kind::vertex_face, point, q[2], q[3], q[4]);
  if (best.distance <= rounding) return best;
  keep(Kind::vertex_face, q[0], q[2], q[3], q[4]);
  keep(Kind::vertex_face, q[1], q[2], q[3], q[4]);
  for (int i = 2; i < 5; ++i) keep(Kind::edge_edge, q[0], q[1], q[i], q[i < 4 ? i + 1 : 2]);
  return best;
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
    const exact::Nearest meet = meeting_place(q);
    gap.points = {row(meet.on_first), row(meet.on_second)};
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

std::vector<Gap> collect_gaps(const NearestPairs& nearest, const Geometry& geometry, const Cancellation& cancellation) {
  const MeshPairs& pairs = nearest.pairs();
  std::vector<Gap> gaps;
  gaps.reserve(pairs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    cancellation.heed();
    gaps.push_back(gap_of(pairs[i][0], pairs[i][1], nearest.found(i), geometry));
  }
  return gaps;
}

}  // namespace hpccd
