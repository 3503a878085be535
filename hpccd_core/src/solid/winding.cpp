// SPDX-License-Identifier: Apache-2.0
#include "solid/winding.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "elementary/exact/boxes.h"
#include "elementary/exact/integers.h"
#include "elementary/exact/intersection.h"
#include "elementary/exact/vector.h"
#include "solid/crossing.h"

namespace hpccd {
namespace {

using V = Vec3<double>;

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
    Crossing c = crossing(q);
    if (!c.certain) c = exact::crossing(q);
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
