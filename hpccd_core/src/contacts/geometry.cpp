// SPDX-License-Identifier: Apache-2.0
#include "contacts/geometry.h"

#include <algorithm>
#include <cmath>

#include "contacts/meeting_point.h"
#include "elementary/inside.h"

namespace hpccd {
namespace {

using V = Vec3<double>;

V at(const VertexRow& row, double t) {
  return interpolate(V{row.t0[0], row.t0[1], row.t0[2]}, V{row.t1[0], row.t1[1], row.t1[2]}, t);
}

V scaled(V v, double by) { return {v.x / by, v.y / by, v.z / by}; }

}  // namespace

ContactPoint contact_point(const Geometry& g, Kind kind, std::uint32_t first, std::uint32_t second, double toc) {
  std::uint32_t v[4];
  if (kind == Kind::vertex_face)
    v[0] = first, v[1] = g.faces[second][0], v[2] = g.faces[second][1], v[3] = g.faces[second][2];
  else
    v[0] = g.edges[first][0], v[1] = g.edges[first][1], v[2] = g.edges[second][0], v[3] = g.edges[second][1];
  const V q0 = at(g.vertices[v[0]], toc), q1 = at(g.vertices[v[1]], toc), q2 = at(g.vertices[v[2]], toc),
          q3 = at(g.vertices[v[3]], toc);
  // The two spanning vectors, and the side from which the second feature (edge b, or the vertex) comes at t = 0.
  const bool vf = kind == Kind::vertex_face;
  const V a = vf ? q2 - q1 : q1 - q0, b = vf ? q3 - q1 : q3 - q2;
  const double size = std::max(max_norm(a), max_norm(b));
  V point = q0, normal{0, 0, 0};
  if (size > 0) normal = unit(cross(scaled(a, size), scaled(b, size)));
  if (!vf) {
    // On the shorter edge: what is within rounding of it need not be within 1e-9 of its length on the longer one.
    const Segment on_a{{0, 0, 0}, a}, on_b{q2 - q0, b};
    point = largest(a) < largest(b) ? q0 + meeting_place(on_b, on_a) * a : q2 + meeting_place(on_a, on_b) * b;
  }
  const auto start = [&](int i) {
    const double* x = g.vertices[v[i]].t0;
    return V{x[0], x[1], x[2]};
  };
  const V from = vf ? start(0) - start(1) : start(2) - start(0);
  const V to = vf ? q0 - q1 : q2 - q0;
  // Displacement out of the plane before contact; the sign of the normal follows it.
  const double side = dot(unit(from), normal) != 0 ? dot(unit(from), normal) : dot(unit(from - to), normal);
  if (side < 0) normal = {-normal.x, -normal.y, -normal.z};
  return {{point.x, point.y, point.z}, {normal.x, normal.y, normal.z}};
}

}  // namespace hpccd
