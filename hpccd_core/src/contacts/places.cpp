// SPDX-License-Identifier: Apache-2.0
#include "contacts/places.h"

#include "contacts/nearest_points.h"

namespace hpccd {
namespace {

std::array<double, 3> row(const Vec3<double>& v) { return {v.x, v.y, v.z}; }

}  // namespace

void write_places(Contacts& c, std::size_t i, const Candidate& pair, double toc, const Geometry& geometry,
                  Outputs outputs) {
  if (!outputs.points && !outputs.normals && !outputs.closest) return;
  const UndecidedPair q = undecided_pair(geometry, pair);
  const bool separated = outputs.at == AtTime::contact && q.separation > 0;
  std::optional<NearestPoints> nearest;
  if (outputs.closest || separated) nearest = nearest_points(q, outputs.at == AtTime::contact ? toc : 0);
  if (outputs.closest) c.closest[i] = {row(nearest->on_first), row(nearest->on_second)};
  if (!outputs.points && !outputs.normals) return;
  // At no distance as in plain contact: there is no direction between the points.
  const bool apart = separated && nearest->distance > 0;
  const ContactPoint p = apart ? ContactPoint{} : contact_point(geometry, pair.kind, pair.first, pair.second, toc);
  if (outputs.points)
    c.points[i] = apart ? row(0.5 * nearest->on_first + 0.5 * nearest->on_second)
                        : std::array<double, 3>{p.point[0], p.point[1], p.point[2]};
  if (outputs.normals)
    c.normals[i] = apart ? row(nearest->direction) : std::array<double, 3>{p.normal[0], p.normal[1], p.normal[2]};
}

}  // namespace hpccd
