// SPDX-License-Identifier: Apache-2.0
#include "contacts/places.h"

#include <algorithm>

#include "contacts/pair_places.h"

namespace hpccd {
namespace {

std::array<double, 3> row(const Vec3<double>& v) { return {v.x, v.y, v.z}; }

}  // namespace

PairPlaces pair_places(const UndecidedPair& q, double toc, Outputs outputs) {
  ByIntegers integers;
  return q.kind == Kind::vertex_face ? pair_places<Kind::vertex_face>(q.t0, q.t1, toc, q.separation, outputs, integers)
                                     : pair_places<Kind::edge_edge>(q.t0, q.t1, toc, q.separation, outputs, integers);
}

void write_places(Contacts& c, std::size_t i, const UndecidedPair& pair, double toc, Outputs outputs) {
  const PairPlaces places = pair_places(pair, toc, outputs);
  if (outputs.points) c.points[i] = row(places.point);
  if (outputs.normals) c.normals[i] = row(places.normal);
  if (outputs.closest) c.closest[i] = {row(places.closest[0]), row(places.closest[1])};
  if (!outputs.weights) return;
  std::ranges::copy(places.weights, c.weights[i].begin());
  if (outputs.at == AtTime::contact) c.approach[i] = places.approach;
}

void write_places(Contacts& c, std::size_t i, const Candidate& pair, double toc, const Geometry& geometry,
                  Outputs outputs) {
  if (!outputs.any()) return;
  write_places(c, i, undecided_pair(geometry, pair), toc, outputs);
  if (outputs.weights) pair_vertices(geometry, pair.kind, pair.first, pair.second, c.vertices[i].data());
}

}  // namespace hpccd
