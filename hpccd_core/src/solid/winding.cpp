// SPDX-License-Identifier: Apache-2.0
#include "solid/winding.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <vector>

#include "base/simd/four.h"
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

}  // namespace

// Bits as in exact/intersection.cpp. Rarely needed: inlined, it would also make GCC 12 warn of sizes that do not occur.
[[gnu::noinline]] Crossing crossing(const V q[4]) {
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

}  // namespace exact

namespace {

bool on_triangle(const V q[4]) {
  const V point_and_face[5] = {q[0], q[0], q[1], q[2], q[3]};
  return exact::intersect(point_and_face);
}

double least_of(double a, double b, double c) { return std::min(std::min(a, b), c); }
double greatest_of(double a, double b, double c) { return std::max(std::max(a, b), c); }

// Rays along an axis from points near each other. They go along x where the points are on that side of the middle, else
// against it: there are fewer faces that way.
class Rays {
 public:
  Rays(const Tree& tree, const MotionBounds& snapshot, const PlacedMeshes* placed, const Features& features,
       std::span<const V> points, std::span<Winding> found)
      : tree_(tree), snapshot_(snapshot), placed_(placed), features_(features), points_(points), found_(found) {
    for (int k = 0; k < 3; ++k) {
      for (std::size_t i = 0; i < points.size(); ++i) {
        const double x = exact::coordinate(points[i], k);
        at_[k][i] = snapshot.squeezed.empty() ? snapshot.map(x, k) : snapshot.squeezed[static_cast<std::size_t>(k)](x);
      }
      const auto [low, high] = std::minmax_element(at_[k], at_[k] + points.size());
      around_.low[k] = *low, around_.high[k] = *high;
    }
    const Box whole = box_of(tree.nodes[0]);
    backwards_ = around_.low[0] + around_.high[0] < whole.low[0] + whole.high[0];
    std::ranges::fill(found, Winding{0, false});
  }

  void search(std::uint32_t mesh) {
    std::vector<std::uint32_t> stack{0};
    while (!stack.empty()) {
      const Node& node = tree_.nodes[stack.back()];
      stack.pop_back();
      if (node.mesh != mixed_meshes && node.mesh != mesh) continue;
      const Box box = box_of(node);
      if (!may_meet(box)) continue;
      if (node.children)
        stack.push_back(node.children + 1), stack.push_back(node.children);
      else if (const unsigned which = that_may_meet(box))
        test(tree_.leaves[node.leaf], which);
    }
    for (Winding& w : found_)
      if (w.on_surface) w.number = 0;
  }

 private:
  Box box_of(const Node& node) const { return placed_ ? placed_->at_pose(node).box.t0 : node.box.t0; }
  V position(std::uint32_t vertex) const {
    if (placed_) return placed_->position(vertex);
    const double* x = snapshot_.vertices[vertex].t0;
    return {x[0], x[1], x[2]};
  }

  bool may_meet(const Box& box) const {
    return (around_.high[1] >= box.low[1]) & (around_.low[1] <= box.high[1]) & (around_.high[2] >= box.low[2]) &
           (around_.low[2] <= box.high[2]) &
           (backwards_ ? around_.high[0] >= box.low[0] : around_.low[0] <= box.high[0]);
  }

  // Bit i: the ray of point i.
  unsigned that_may_meet(const Box& box) const {
    unsigned which = 0;
    const auto all = [](float x) { return Floats4{x, x, x, x}; };
    for (std::size_t i = 0; i < points_.size(); i += 4) {
      const Floats4 x = load4(at_[0] + i), y = load4(at_[1] + i), z = load4(at_[2] + i);
      const Mask4 ahead = backwards_ ? x >= all(box.low[0]) : x <= all(box.high[0]);
      which |= bits4(ahead & (y >= all(box.low[1])) & (y <= all(box.high[1])) & (z >= all(box.low[2])) &
                     (z <= all(box.high[2])))
               << i;
    }
    return which & ((1u << points_.size()) - 1);
  }

  void test(const LeafRange& leaf, unsigned which) {
    V q[4];
    for (std::uint32_t slot = leaf.first_face; slot < leaf.end_face; ++slot) {
      const auto& corners = features_.faces[tree_.face_of_slot[slot]];
      for (std::size_t i = 0; i < 3; ++i) q[1 + i] = position(corners[i]);
      const V low{least_of(q[1].x, q[2].x, q[3].x), least_of(q[1].y, q[2].y, q[3].y), least_of(q[1].z, q[2].z, q[3].z)};
      const V high{greatest_of(q[1].x, q[2].x, q[3].x), greatest_of(q[1].y, q[2].y, q[3].y),
                   greatest_of(q[1].z, q[2].z, q[3].z)};
      for (unsigned left = which; left != 0; left &= left - 1) {
        const auto i = static_cast<std::size_t>(std::countr_zero(left));
        const V& p = points_[i];
        if ((p.y < low.y) | (p.y > high.y) | (p.z < low.z) | (p.z > high.z) | (backwards_ ? p.x < low.x : p.x > high.x))
          continue;
        q[0] = p;
        Crossing c = crossing(q);
        if (!c.certain) c = exact::crossing(q);
        if (c.ahead == 0 && (c.turn != 0 || (p.x >= low.x && p.x <= high.x && on_triangle(q))))
          found_[i].on_surface = true;
        else if (c.turn != 0 && (c.ahead < 0) == backwards_)
          found_[i].number += backwards_ ? -c.turn : c.turn;
      }
    }
  }

  const Tree& tree_;
  const MotionBounds& snapshot_;
  const PlacedMeshes* const placed_;
  const Features& features_;
  std::span<const V> points_;
  std::span<Winding> found_;
  float at_[3][points_at_once] = {};  // in coordinates of boxes
  Box around_;
  bool backwards_;
};

}  // namespace

void winding_numbers(const Tree& tree, const MotionBounds& snapshot, const Features& features, std::uint32_t mesh,
                     std::span<const Vec3<double>> points, std::span<Winding> found, const PlacedMeshes* placed) {
  if (!points.empty() && !tree.nodes.empty()) return Rays(tree, snapshot, placed, features, points, found).search(mesh);
  std::ranges::fill(found, Winding{0, false});
}

Winding winding_number(const Tree& tree, const MotionBounds& snapshot, const Features& features, std::uint32_t mesh,
                       const Vec3<double>& point) {
  Winding found;
  winding_numbers(tree, snapshot, features, mesh, {&point, 1}, {&found, 1});
  return found;
}

}  // namespace hpccd
