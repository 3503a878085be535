// SPDX-License-Identifier: Apache-2.0
#include "solid/outside_list.h"

#include <algorithm>
#include <cmath>
#include <mutex>

namespace hpccd {
namespace {

constexpr std::size_t vertices_a_piece = 4096;

// A distance that two boxes prove, from their distance in coordinates of the boxes: the inverse of reach_of
// (traverse/leaf_hulls.h), rounded down.
double proven_by_boxes(double gap, const MotionBounds& snapshot) {
  return ((gap - 1e-6) / (1 + 1e-6) / snapshot.box_scale - snapshot.box_rounding) * (1 - 1e-15);
}

}  // namespace

double clearance_of(const Tree& tree, const MotionBounds& snapshot, std::uint32_t mesh, std::uint32_t vertex) {
  Node point;
  point.box = snapshot.boxes[vertex];
  float least = std::numeric_limits<float>::infinity();
  std::vector<std::uint32_t> stack{0};
  while (!stack.empty()) {
    const std::uint32_t number = stack.back();
    stack.pop_back();
    const Node& node = tree.nodes[number];
    if (node.mesh != mixed_meshes && node.mesh != mesh) continue;
    const float square = node.mesh == mesh ? node.square_of_gap(point) : 0;
    if (square >= least) continue;
    if (!node.children) {
      least = square;
      continue;
    }
    const std::uint32_t left = node.children, right = left + 1;
    const bool left_first = tree.nodes[left].square_of_gap(point) <= tree.nodes[right].square_of_gap(point);
    stack.push_back(left_first ? right : left);
    stack.push_back(left_first ? left : right);
  }
  // 4e-7: the square was rounded three times.
  return std::max(proven_by_boxes(std::sqrt(double{least} * (1 - 4e-7)), snapshot), 0.0);
}

OutsideList::OutsideList(const Tree& tree, const MotionBounds& snapshot, std::uint32_t mesh, VertexRange of_mesh,
                         std::span<const std::uint32_t> vertices, ThreadPool& pool)
    : of_mesh_(of_mesh) {
  const auto point = [&](std::size_t vertex) {
    const double* x = snapshot.vertices[vertex].t0;
    return Point{x[0], x[1], x[2]};
  };
  resize(mesh_, of_mesh.end - of_mesh.begin, pool.cancellation());
  resize(listed_, vertices.size(), pool.cancellation());
  parallel_for(pool, mesh_.size(), vertices_a_piece, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t i = begin; i < end; ++i) mesh_[i] = point(of_mesh.begin + i);
  });
  parallel_for(pool, listed_.size(), 16, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t i = begin; i < end; ++i)
      listed_[i] = {vertices[i], point(vertices[i]), clearance_of(tree, snapshot, mesh, vertices[i])};
  });
}

void OutsideList::follow(const MotionBounds& snapshot, ThreadPool& pool) {
  moved_ = {};
  std::mutex lock;
  parallel_for(pool, mesh_.size(), vertices_a_piece, [&](std::size_t begin, std::size_t end, int) {
    Extent moved;
    for (std::size_t i = begin; i < end; ++i)
      for (int k = 0; k < 3; ++k) {
        const double by = snapshot.vertices[of_mesh_.begin + i].t0[k] - mesh_[i].x[k];
        moved.low[k] = std::min(moved.low[k], by);
        moved.high[k] = std::max(moved.high[k], by);
      }
    const std::lock_guard guard(lock);
    moved_.include(moved);
  });
}

// In the straight motion from the list's snapshot, each point of the surface moves by a weighted mean of displacements
// of vertices, which are within moved_. So the vertex moves by at most `way` relative to it.
bool OutsideList::still_outside(const MotionBounds& snapshot, std::uint32_t vertex) const {
  const auto listed = std::ranges::lower_bound(listed_, vertex, {}, &Listed::vertex);
  if (listed == listed_.end() || listed->vertex != vertex) return false;
  double way[3], size = 0;
  for (int k = 0; k < 3; ++k) {
    const double by = snapshot.vertices[vertex].t0[k] - listed->at.x[k];
    way[k] = std::max(std::fabs(by - moved_.low[k]), std::fabs(by - moved_.high[k]));
    size = std::max({size, std::fabs(by), std::fabs(moved_.low[k]), std::fabs(moved_.high[k])});
  }
  // Three differences by axis, each rounded by at most 1.2e-16 of 2 `size`, and hypot.
  return std::hypot(way[0], way[1], way[2]) * (1 + 1e-15) + 2e-15 * size < listed->clearance;
}

}  // namespace hpccd
