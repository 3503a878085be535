// SPDX-License-Identifier: Apache-2.0
#include "contacts/gaps.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/double_double.h"
#include "contacts/meeting_point.h"
#include "contacts/places.h"
#include "elementary/exact/distance.h"
#include "elementary/inside.h"
#include "elementary/intersection_batch.h"
#include "elementary/undecided.h"

namespace hpccd {
namespace {

using V = Vec3<double>;

std::array<double, 3> point_of(const V& v) { return {v.x, v.y, v.z}; }

// (b - a) * 2^-exponent, without rounding.
Vec3<DoubleDouble> spanned(const V& a, const V& b, int exponent) {
  const auto along = [&](double from, double to) {
    const DoubleDouble d = detail::two_sum(to, -from);
    return DoubleDouble{std::scalbn(d.high, -exponent), std::scalbn(d.low, -exponent)};
  };
  return {along(a.x, b.x), along(a.y, b.y), along(a.z, b.z)};
}

int exponent_of(double size) { return size > 0 ? std::ilogb(size) : 0; }

// The position on the edge where it meets the plane of the face, with 106 bits: the normal of a needle is too
// inaccurate in double precision. NaN if the edge lies in that plane, or if the face has none.
double place_in_plane(const V q[5], double size) {
  const V &origin = q[2], &first = q[3], &second = q[4];
  const Vec3<DoubleDouble> n = cross(spanned(origin, first, exponent_of(largest(first - origin))),
                                     spanned(origin, second, exponent_of(largest(second - origin))));
  const int exponent = exponent_of(size);
  const DoubleDouble before = dot(spanned(origin, q[0], exponent), n), after = dot(spanned(origin, q[1], exponent), n);
  return (before / (before - after)).high;
}

// Where an edge meets a face: in the plane of the face, if that is accurate enough; otherwise at one end of the edge,
// or where it meets an edge of the face.
exact::Nearest meeting_place(const V q[5]) {
  const double size = std::max(largest(q[0] - q[2]), largest(q[1] - q[2]));
  const double place = place_in_plane(q, size);
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
    gap.points = {point_of(meet.on_first), point_of(meet.on_second)};
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
  const PairPlaces places = pair_places(undecided_pair(g, {found.first, found.second, found.kind}), 0, wanted);
  gap.points = {point_of(places.closest[0]), point_of(places.closest[1])};
  pair_vertices(g, found.kind, found.first, found.second, gap.vertices.data());
  std::ranges::copy(places.weights, gap.weights.begin());
  gap.normal = point_of(places.normal);
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
