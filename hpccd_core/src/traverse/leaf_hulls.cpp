// SPDX-License-Identifier: Apache-2.0
#include "traverse/leaf_hulls.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "base/simd/four.h"
#include "base/vec3.h"

namespace hpccd {
namespace {

using V = Vec3<float>;

Floats4 all4(float x) { return Floats4{x, x, x, x}; }

// The farthest corner along a direction; any of them if there are several.
V farthest(const Tree& tree, const LeafRange& leaf, const V& along) {
  const CornerRow* rows = tree.rows_of(leaf);
  const Floats4 m[3] = {all4(along.x), all4(along.y), all4(along.z)};
  Floats4 most = all4(-INFINITY), at[3] = {};
  for (std::uint32_t i = 0, lane = 0; i < leaf.n_corners(); i += 4, lane += 4) {
    if (lane == CornerRow::width) lane = 0, rows += tree.rows_per_group();
    const Floats4 x = load4(rows[0].lane + lane), y = load4(rows[1].lane + lane), z = load4(rows[2].lane + lane);
    const Floats4 place = x * m[0] + y * m[1] + z * m[2];
    const Mask4 farther = place > most;
    most = farther ? place : most;
    at[0] = farther ? x : at[0], at[1] = farther ? y : at[1], at[2] = farther ? z : at[2];
  }
  int best = most[1] > most[0];
  const int other = 2 + (most[3] > most[2]);
  best = most[other] > most[best] ? other : best;
  return {at[0][best], at[1][best], at[2][best]};
}

V middle(const Box& box) {
  return {0.5f * (box.low[0] + box.high[0]), 0.5f * (box.low[1] + box.high[1]), 0.5f * (box.low[2] + box.high[2])};
}

const Node& node_of(const Tree& tree, const LeafRange& leaf) {
  return tree.nodes[tree.leaf_nodes[static_cast<std::size_t>(&leaf - tree.leaves.data())]];
}

}  // namespace

bool far_apart(const Node& a, const Node& b, float reach) {
  float size = 0;
  for (const Box* box : {&a.box.t0, &b.box.t0})
    for (int k = 0; k < 3; ++k) size = std::max(size, box->high[k] - box->low[k]);
  return size < reach;
}

bool share_a_vertex(const Tree& tree, const LeafRange& a, const LeafRange& b) {
  const std::uint32_t *of_a = tree.corners.data() + a.first_corner, *of_b = tree.corners.data() + b.first_corner;
  const std::uint32_t n_a = a.n_corners(), n_b = b.n_corners();
  for (std::uint32_t i = 0; i < n_a; ++i) {
    std::uint32_t equal = 0;
    for (std::uint32_t j = 0; j < n_b; ++j) equal |= of_a[i] == of_b[j];
    if (equal) return true;
  }
  return false;
}

// Gilbert's algorithm (1966) for the point of the Minkowski difference that is nearest to zero: each step gives a
// direction along which the hulls may be apart, and a lower bound on their distance.
//
// Errors of a gap along a direction: corners were rounded to floats, 1.2e-7 along each axis and 4.2e-7 for two corners
// along any direction; products and their sums, of 3.9 at most, 7e-7 each; their difference 4.7e-7. The sum is 2.3e-6.
// reach_of() accounts for 1e-6 of it, and for the relative error of the length of the direction.
bool farther_apart(const Tree& tree, const LeafRange& a, const LeafRange& b, float reach) {
  constexpr float rounding = 2e-6f;
  constexpr int most_steps = 6;
  V v = middle(node_of(tree, b).box.t0) - middle(node_of(tree, a).box.t0);
  for (int step = 0; step < most_steps; ++step) {
    const float length = std::sqrt(dot(v, v));
    if (!(length > reach)) return false;  // after the first step: of two points of the difference
    const V along = (1 / length) * v;
    const V difference = farthest(tree, b, -1.0f * along) - farthest(tree, a, along);
    if (dot(difference, along) > reach + rounding) return true;
    if (step == 0) {
      v = difference;
      continue;
    }
    // The nearest point on the segment between both.
    const V way = difference - v;
    const float square = dot(way, way), part = -dot(v, way);
    if (!(part > 0)) return false;
    v = v + std::fmin(part / square, 1.0f) * way;
  }
  return false;
}

}  // namespace hpccd
