// SPDX-License-Identifier: Apache-2.0
#include "traverse/near_corners.h"

#include <cmath>
#include <limits>

#include "traverse/tasks.h"

namespace hpccd {
namespace {

// Two leaves, by their nodes.
NodePair near_leaves(const Tree& tree, NodePair p) {
  constexpr AtLeaves ends;
  while (!is_end(tree.nodes, p, ends)) {
    NodePair nearest{};
    float least = std::numeric_limits<float>::infinity();
    refine(tree.nodes, p, ends, [&](NodePair q) {
      const float gap = tree.nodes[q.a].square_of_gap(tree.nodes[q.b]);
      if (gap < least) least = gap, nearest = q;
    });
    p = nearest;
  }
  return p;
}

// The corners of a leaf, in coordinates of the boxes.
struct LeafCorners {
  const LeafRange& leaf;
  const std::uint32_t* vertices;
  const CornersOf& features;
  float at[CornersOf::most_corners][3];

  LeafCorners(const Tree& tree, const MotionBounds& snapshot, std::uint32_t number)
      : leaf(tree.leaves[number]),
        vertices(tree.corners.data() + leaf.first_corner),
        features(tree.corners_of[number]) {
    for (std::uint32_t i = 0; i < leaf.n_corners(); ++i)
      for (int k = 0; k < 3; ++k) at[i][k] = snapshot.map(snapshot.vertices[vertices[i]].t0[k], k);
  }
};

// Every vertex is tested against every face of another mesh, edges against edges.
bool are_tested(const LeafCorners& a, std::uint32_t i, const LeafCorners& b, std::uint32_t j) {
  return a.features.faces_at[i] || b.features.faces_at[j] || (a.features.edges_at[i] && b.features.edges_at[j]);
}

}  // namespace

double distance_of_near_corners(const Tree& tree, const MotionBounds& snapshot, std::uint32_t a, std::uint32_t b) {
  const NodePair leaves = near_leaves(tree, {a, b});
  const LeafCorners of_a(tree, snapshot, tree.nodes[leaves.a].leaf), of_b(tree, snapshot, tree.nodes[leaves.b].leaf);
  constexpr float infinity = std::numeric_limits<float>::infinity();
  float least = infinity;
  std::uint32_t nearest[2] = {};
  for (std::uint32_t i = 0; i < of_a.leaf.n_corners(); ++i)
    for (std::uint32_t j = 0; j < of_b.leaf.n_corners(); ++j) {
      float square = 0;
      for (int k = 0; k < 3; ++k) {
        const float d = of_a.at[i][k] - of_b.at[j][k];
        square += d * d;
      }
      if (square < least && are_tested(of_a, i, of_b, j)) least = square, nearest[0] = i, nearest[1] = j;
    }
  if (least == infinity) return infinity;
  const auto &x = snapshot.vertices[of_a.vertices[nearest[0]]].t0, &y = snapshot.vertices[of_b.vertices[nearest[1]]].t0;
  return std::hypot(x[0] - y[0], x[1] - y[1], x[2] - y[2]);
}

}  // namespace hpccd
