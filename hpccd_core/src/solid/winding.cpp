// SPDX-License-Identifier: Apache-2.0
#include "solid/winding.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "elementary/exact/boxes.h"
#include "elementary/exact/integers.h"
#include "elementary/exact/intersection.h"
#include "elementary/exact/vector.h"

namespace hpccd {
namespace {

using V = Vec3<double>;

// How the ray from a point along +x crosses a triangle: `turn` is 1 if the corners are counterclockwise seen against
// the ray's direction, -1 if clockwise, 0 without a crossing of the ray's line. `ahead`: sign of the crossing's x minus
// that of the point; 0: the point is on the triangle, or may be on it if there is no crossing.
//
// The line never meets an edge or a vertex: the point counts as moved by (eps, eps^2) along y and z, with an
// infinitesimal eps (Edelsbrunner and Muecke 1990). An orientation in the plane of y and z that is zero then has the
// sign of its derivative with respect to the point's y, or else to its z. The two faces of an edge see it alike.
struct Crossing {
  int turn, ahead;
};

int sign_of(double x) { return (x > 0) - (x < 0); }

// The orientation of the point and two corners b, c that it has after the move, if it is zero before: the derivatives
// are b.z - c.z and c.y - b.y.
int turn_when_moved(const V& b, const V& c) { return b.z != c.z ? sign_of(b.z - c.z) : sign_of(c.y - b.y); }

}  // namespace

namespace exact {
namespace {

template <class Z>
Crossing crossing(const V q[4], const OddMantissa at[3][4], const int low[3]) {
  Vector<Z> p[4];
  for (int i = 0; i < 4; ++i)
    for (int k = 0; k < 3; ++k) p[i][k] = scaled_integer<Z>(at[k][i], low[k]);
  const Vector<Z> to[3] = {p[1] - p[0], p[2] - p[0], p[3] - p[0]};
  int turn = 0;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    int s = sign(cross(to[i], to[j], 0));
    if (s == 0) s = turn_when_moved(q[1 + i], q[1 + j]);
    if (s == 0 || s == -turn) return {0, 0};
    turn = s;
  }
  return {turn, turn * sign(dot(to[0], cross(to[1], to[2])))};
}

// Bits as in exact/intersection.cpp.
Crossing crossing(const V q[4]) {
  OddMantissa at[3][4];
  int low[3], bits = 1;
  for (int k = 0; k < 3; ++k) {
    BitRange range;
    for (int i = 0; i < 4; ++i) range.include(at[k][i] = OddMantissa(coordinate(q[i], k)));
    low[k] = range.low;
    bits = std::max(bits, range.bits());
  }
  if (bits <= Widths<Integer<1>>::coordinate_bits) return crossing<Integer<1>>(q, at, low);
  if (bits <= Widths<Integer<2>>::coordinate_bits) return crossing<Integer<2>>(q, at, low);
  return crossing<Big>(q, at, low);
}

}  // namespace
}  // namespace exact

namespace {

// Error bounds (Shewchuk 1997): with u = 2^-53, an orientation in the plane is computed from rounded differences within
// (3 + 16 u) u of the sum of its products' magnitudes, a volume within (7 + 56 u) u. Products that underflow add less
// than `least` each, times a coordinate in a volume. An overflow makes a comparison false.
constexpr double in_plane = 3.4e-16, in_space = 7.8e-16, least = 2.3e-308;

// q: the point and three corners.
Crossing crossing(const V q[4]) {
  const V a = q[1] - q[0], b = q[2] - q[0], c = q[3] - q[0];
  double orientation[3], size[3];
  int turn = 0;
  const V* corners[4] = {&a, &b, &c, &a};
  bool certain = true;
  for (int i = 0; i < 3; ++i) {
    const V &from = *corners[i], &to = *corners[i + 1];
    const double left = from.y * to.z, right = from.z * to.y;
    orientation[i] = left - right, size[i] = std::fabs(left) + std::fabs(right);
    if (!(std::fabs(orientation[i]) > in_plane * size[i] + least)) {
      certain = false;
      continue;
    }
    const int s = sign_of(orientation[i]);
    if (s == -turn) return {0, 1};  // strictly outside in the plane
    turn = s;
  }
  if (!certain) return exact::crossing(q);
  if (a.x > 0 && b.x > 0 && c.x > 0) return {turn, 1};
  if (a.x < 0 && b.x < 0 && c.x < 0) return {turn, -1};
  const double volume = a.x * orientation[1] + b.x * orientation[2] + c.x * orientation[0];
  const double bound = in_space * (std::fabs(a.x) * size[1] + std::fabs(b.x) * size[2] + std::fabs(c.x) * size[0]) +
                       4 * least * (1 + std::fabs(a.x) + std::fabs(b.x) + std::fabs(c.x));
  if (!(std::fabs(volume) > bound)) return exact::crossing(q);
  return {turn, turn * sign_of(volume)};
}

bool on_triangle(const V q[4]) {
  const V point_and_face[5] = {q[0], q[0], q[1], q[2], q[3]};
  return exact::intersect(point_and_face);
}

V position(const MotionBounds& snapshot, std::uint32_t vertex) {
  const double* x = snapshot.vertices[vertex].t0;
  return {x[0], x[1], x[2]};
}

}  // namespace

Winding winding_number(const Tree& tree, const MotionBounds& snapshot, const Features& features, std::uint32_t mesh,
                       const Vec3<double>& point) {
  float at[3];
  for (int k = 0; k < 3; ++k) {
    const double x = exact::coordinate(point, k);
    at[k] = snapshot.squeezed.empty() ? snapshot.map(x, k) : snapshot.squeezed[static_cast<std::size_t>(k)](x);
  }
  const auto meets_ray = [&](const Box& box) {
    return (at[1] >= box.low[1]) & (at[1] <= box.high[1]) & (at[2] >= box.low[2]) & (at[2] <= box.high[2]) &
           (at[0] <= box.high[0]);
  };
  Winding winding{0, false};
  V q[4] = {point};
  const auto test = [&](std::uint32_t face) {
    for (int i = 0; i < 3; ++i) q[1 + i] = position(snapshot, features.faces[face][static_cast<std::size_t>(i)]);
    const auto y = std::minmax({q[1].y, q[2].y, q[3].y}), z = std::minmax({q[1].z, q[2].z, q[3].z});
    const auto x = std::minmax({q[1].x, q[2].x, q[3].x});
    if (point.y < y.first || point.y > y.second || point.z < z.first || point.z > z.second || point.x > x.second)
      return true;
    const Crossing c = crossing(q);
    winding.on_surface = c.ahead == 0 && (c.turn != 0 || (point.x >= x.first && on_triangle(q)));
    if (c.turn != 0 && c.ahead > 0) winding.number += c.turn;
    return !winding.on_surface;
  };
  if (tree.nodes.empty()) return winding;
  std::vector<std::uint32_t> stack{0};
  while (!stack.empty()) {
    const Node& node = tree.nodes[stack.back()];
    stack.pop_back();
    if ((node.mesh != mixed_meshes && node.mesh != mesh) || !meets_ray(node.box.t0)) continue;
    if (node.children) {
      stack.push_back(node.children + 1), stack.push_back(node.children);
      continue;
    }
    const LeafRange& leaf = tree.leaves[node.leaf];
    for (std::uint32_t slot = leaf.first_face; slot < leaf.end_face; ++slot)
      if (!test(tree.face_of_slot[slot])) return {0, true};
  }
  return winding;
}

}  // namespace hpccd
