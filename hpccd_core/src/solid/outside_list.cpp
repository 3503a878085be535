// SPDX-License-Identifier: Apache-2.0
#include "solid/outside_list.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <utility>

namespace hpccd {
namespace {

constexpr std::size_t vertices_a_piece = 4096;

// A distance that two boxes prove, from their distance in coordinates of the boxes: the inverse of reach_of
// (traverse/leaf_hulls.h), rounded down.
double proven_by_boxes(double gap, const MotionBounds& snapshot) {
  return ((gap - 1e-6) / (1 + 1e-6) / snapshot.box_scale - snapshot.box_rounding) * (1 - 1e-15);
}

double clearance_of(const Tree& tree, const MotionBounds& snapshot, const Features& features, std::uint32_t mesh,
                    std::uint32_t vertex) {
  Node point;
  point.box = snapshot.boxes[vertex];
  float least = std::numeric_limits<float>::infinity();
  std::vector<std::uint32_t> stack{0};
  while (!stack.empty()) {
    const Node& node = tree.nodes[stack.back()];
    stack.pop_back();
    if (node.mesh != mixed_meshes && node.mesh != mesh) continue;
    if ((node.mesh == mesh ? node.square_of_gap(point) : 0) >= least) continue;
    if (node.children) {
      const std::uint32_t left = node.children, right = left + 1;
      const bool left_first = tree.nodes[left].square_of_gap(point) <= tree.nodes[right].square_of_gap(point);
      stack.push_back(left_first ? right : left), stack.push_back(left_first ? left : right);
      continue;
    }
    // Boxes of faces: those of leaves span the pits of a surface.
    const LeafRange& leaf = tree.leaves[node.leaf];
    for (std::uint32_t slot = leaf.first_face; slot < leaf.end_face; ++slot) {
      Node face;
      for (const std::uint32_t corner : features.faces[tree.face_of_slot[slot]])
        face.box.include(snapshot.boxes[corner]);
      least = std::min(least, face.square_of_gap(point));
    }
  }
  // 4e-7: the square was rounded three times.
  return std::max(proven_by_boxes(std::sqrt(double{least} * (1 - 4e-7)), snapshot), 0.0);
}

}  // namespace

OutsideList::OutsideList(const MotionBounds& snapshot, VertexRange of_mesh, std::size_t n, ThreadPool& pool)
    : of_mesh_(of_mesh) {
  resize(mesh_, of_mesh.end - of_mesh.begin, pool.cancellation());
  resize(listed_, n, pool.cancellation());
  follow(snapshot, pool);
}

void OutsideList::follow(const MotionBounds& snapshot, ThreadPool& pool) {
  ++number_;
  moved_ = {};
  std::mutex lock;
  parallel_for(pool, mesh_.size(), vertices_a_piece, [&](std::size_t begin, std::size_t end, int) {
    Extent moved;
    for (std::size_t i = begin; i < end; ++i)
      for (int k = 0; k < 3; ++k) {
        const double at = snapshot.vertices[of_mesh_.begin + i].t0[k], by = at - mesh_[i].x[k];
        moved.low[k] = std::min(moved.low[k], by);
        moved.high[k] = std::max(moved.high[k], by);
        mesh_[i].x[k] = at;
      }
    const std::lock_guard guard(lock);
    moved_.include(moved);
  });
}

// In the straight motion from the snapshot before, each point of the surface moves by a weighted mean of displacements
// of vertices, which are within moved_. So the vertex moves by at most `way` relative to it.
bool OutsideList::still_outside(const MotionBounds& snapshot, std::size_t i, std::uint32_t vertex) {
  Listed& listed = listed_[i];
  const double* x = snapshot.vertices[vertex].t0;
  double way[3], size = 0;
  for (int k = 0; k < 3; ++k) {
    const double by = x[k] - std::exchange(listed.at.x[k], x[k]);
    way[k] = std::max(std::fabs(by - moved_.low[k]), std::fabs(by - moved_.high[k]));
    size = std::max({size, std::fabs(by), std::fabs(moved_.low[k]), std::fabs(moved_.high[k])});
  }
  // Three differences by axis, each rounded by at most 1.2e-16 of 2 `size`, and the root. Squares may overflow, which
  // leaves nothing; those that may vanish are not used.
  const double square = way[0] * way[0] + way[1] * way[1] + way[2] * way[2];
  const double length = square > 1e-280 ? std::sqrt(square) : way[0] + way[1] + way[2];
  const bool follows = std::exchange(listed.followed, number_) + 1 == number_;
  const double left = (listed.clearance - length * (1 + 1e-15) - 2e-15 * size) * (1 - 1e-15);
  listed.clearance = follows && left > 1e-290 ? left : 0;
  listed.lasted += listed.clearance > 0;
  return listed.clearance > 0;
}

void OutsideList::measure(const Tree& tree, const MotionBounds& snapshot, const Features& features, std::uint32_t mesh,
                          std::size_t i, std::uint32_t vertex) {
  constexpr int pause = 16;
  Listed& listed = listed_[i];
  // It costs about as much as a decision.
  if (listed.lasted == 0 || listed.lasted == 1) listed.rests = pause;
  listed.lasted = -1;
  if (listed.rests > 0) {
    --listed.rests;
    return;
  }
  listed.lasted = 0;
  listed.clearance = clearance_of(tree, snapshot, features, mesh, vertex);
}

}  // namespace hpccd
