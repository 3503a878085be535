// SPDX-License-Identifier: Apache-2.0
#include "traverse/drift.h"

#include <algorithm>
#include <cmath>

#include "bvh/coordinate_map.h"

namespace hpccd {
namespace {

constexpr std::size_t vertex_grain = 1024, leaf_grain = 128;
const Floats4 none = {Box::inf, Box::inf, Box::inf, Box::inf};

CoordinateMap map_around(const std::vector<Vec3<double>>& snapshot) {
  Vec3<double> low = snapshot.front(), high = low;
  for (const Vec3<double>& x : snapshot) {
    low = {std::min(low.x, x.x), std::min(low.y, x.y), std::min(low.z, x.z)};
    high = {std::max(high.x, x.x), std::max(high.y, x.y), std::max(high.z, x.z)};
  }
  const double from[3] = {low.x, low.y, low.z}, to[3] = {high.x, high.y, high.z};
  return CoordinateMap::around(from, to);
}

}  // namespace

// Boxes of all nodes, from boxes of the vertices.
template <class Box, class OfVertex>
void Drift::join(const Tree& tree, std::vector<Box>& boxes, Box none, OfVertex&& of_vertex, ThreadPool& pool) {
  resize(boxes, tree.nodes.size(), pool.cancellation());
  parallel_for(pool, tree.leaves.size(), leaf_grain, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t i = begin; i < end; ++i) {
      const LeafRange& leaf = tree.leaves[i];
      Box box = none;
      for (std::uint32_t c = leaf.first_corner; c < leaf.end_corner; ++c) box.include(of_vertex(tree.corners[c]));
      boxes[tree.leaf_nodes[i]] = box;
    }
  });
  for (std::size_t i = tree.nodes.size(); i-- > 0;)  // children come after their parents
    if (const std::uint32_t child = tree.nodes[i].children) {
      boxes[i] = boxes[child];
      boxes[i].include(boxes[child + 1]);
    }
}

void Drift::begin(const Tree& tree, const std::vector<Vec3<double>>& snapshot, ThreadPool& pool) {
  const CoordinateMap map = map_around(snapshot);
  scale_ = map.scale;
  const auto of_vertex = [&](std::uint32_t v) {
    const Vec3<double>& x = snapshot[v];
    const Floats4 at = {map(x.x, 0), map(x.y, 1), map(x.z, 2), 0};
    return Place{at, at};
  };
  join(tree, places_, {none, -none}, of_vertex, pool);
}

void Drift::fit(const Tree& tree, const std::vector<VertexMotion>& motion, const std::vector<Vec3<double>>& snapshot,
                ThreadPool& pool) {
  resize(vertices_, motion.size(), pool.cancellation());
  std::vector<double> most(static_cast<std::size_t>(pool.size()), 0.0);
  parallel_for(pool, motion.size(), vertex_grain, [&](std::size_t begin, std::size_t end, int thread) {
    double largest = most[static_cast<std::size_t>(thread)];
    for (std::size_t i = begin; i < end; ++i) {
      const double from[3] = {snapshot[i].x, snapshot[i].y, snapshot[i].z};
      Ends e{};
      for (int k = 0; k < 3; ++k) {
        const double t0 = (motion[i].t0[k] - from[k]) * scale_, t1 = (motion[i].t1[k] - from[k]) * scale_;
        e.t0[k] = static_cast<float>(t0), e.t1[k] = static_cast<float>(t1);
        largest = std::max({largest, std::fabs(t0), std::fabs(t1)});
      }
      vertices_[i] = e;
    }
    most[static_cast<std::size_t>(thread)] = largest;
  });
  largest_ = *std::max_element(most.begin(), most.end());
  const auto of_vertex = [&](std::uint32_t v) {
    const Ends& e = vertices_[v];
    return Ways{e.t0, e.t0, e.t1, e.t1};
  };
  join(tree, ways_, {none, -none, none, -none}, of_vertex, pool);
}

// Displacements are rounded to floats, interpolated and subtracted: along an axis the error is at most 1.1e-6 of the
// largest displacement, and positions below 2.25 add 1.1e-6. Distances whose square could vanish list nothing.
void Drift::listed_within(double distance, double separation) {
  const double surely = distance * scale_ * (1 - 1e-6) - 4e-6 * largest_;
  listed_ = surely > 1e-15 ? static_cast<float>(surely) : 0;
  reach_ = static_cast<float>(separation * scale_ * (1 + 1e-6) + 4e-6 + 4e-6 * largest_);
}

std::size_t Drift::bytes() const {
  return vertices_.capacity() * sizeof(Ends) + ways_.capacity() * sizeof(Ways) + places_.capacity() * sizeof(Place);
}

}  // namespace hpccd
