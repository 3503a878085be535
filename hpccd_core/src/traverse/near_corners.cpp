// SPDX-License-Identifier: Apache-2.0
#include "traverse/near_corners.h"

#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>

#include "traverse/tasks.h"

namespace hpccd {
namespace {

// Two leaves, by their nodes. square_of_gap(pair): squared gap of their boxes; if it overflows, any pair may be
// returned.
template <class SquareOfGap>
NodePair near_leaves(const Tree& tree, NodePair p, SquareOfGap&& square_of_gap) {
  constexpr AtLeaves ends;
  while (!is_end(tree.nodes, p, ends)) {
    std::optional<NodePair> nearest;
    auto least = std::numeric_limits<decltype(square_of_gap(p))>::infinity();
    refine(tree.nodes, p, ends, [&](NodePair q) {
      const auto gap = square_of_gap(q);
      if (!nearest || gap < least) least = gap, nearest = q;
    });
    p = *nearest;
  }
  return p;
}

// The corners of a leaf, in coordinates of the boxes.
template <class Real>
struct LeafCorners {
  const LeafRange& leaf;
  const std::uint32_t* vertices;
  const CornersOf& features;
  Real at[CornersOf::most_corners][3];

  LeafCorners(const Tree& tree, const MotionBounds& snapshot, const PlacedMeshes* placed, std::uint32_t number)
      : leaf(tree.leaves[number]),
        vertices(tree.corners.data() + leaf.first_corner),
        features(tree.corners_of[number]) {
    for (std::uint32_t i = 0; i < leaf.n_corners(); ++i) {
      const std::array<double, 3> x = position(snapshot, placed, vertices[i]);
      for (std::size_t k = 0; k < 3; ++k) at[i][k] = static_cast<Real>(snapshot.map.precise(x[k], static_cast<int>(k)));
    }
  }
};

// Calls f(number) for each bit that is set.
template <class Function>
bool any_of(std::uint32_t bits, Function&& f) {
  for (; bits; bits &= bits - 1)
    if (f(static_cast<std::uint32_t>(std::countr_zero(bits)))) return true;
  return false;
}

// Every vertex is tested against every face of another mesh, edges against edges, unless a filter ignores them.
template <class Real>
bool are_tested(const Tree& tree, const FilterView* filter, const LeafCorners<Real>& a, std::uint32_t i,
                const LeafCorners<Real>& b, std::uint32_t j) {
  const std::uint32_t edges_a = a.features.edges_at[i], edges_b = b.features.edges_at[j];
  if (!filter) return a.features.faces_at[i] || b.features.faces_at[j] || (edges_a && edges_b);
  const auto in_face = [&](const auto& of, std::uint32_t k, const auto& others, std::uint32_t l) {
    return any_of(others.features.faces_at[l], [&](std::uint32_t face) {
      return !filter->vertex_face(of.vertices[k], tree.face_of_slot[others.leaf.first_face + face]);
    });
  };
  return in_face(a, i, b, j) || in_face(b, j, a, i) || any_of(edges_a, [&](std::uint32_t of_a) {
           return any_of(edges_b, [&](std::uint32_t of_b) {
             return !filter->edge_edge(tree.edge_of_slot[a.leaf.first_edge + of_a],
                                       tree.edge_of_slot[b.leaf.first_edge + of_b]);
           });
         });
}

template <class Real>
double distance_of_corners(const Tree& tree, const MotionBounds& snapshot, const PlacedMeshes* placed,
                           const FilterView* filter, NodePair leaves) {
  const LeafCorners<Real> of_a(tree, snapshot, placed, tree.nodes[leaves.a].leaf),
      of_b(tree, snapshot, placed, tree.nodes[leaves.b].leaf);
  constexpr Real infinity = std::numeric_limits<Real>::infinity();
  Real least = infinity;
  std::uint32_t nearest[2] = {};
  for (std::uint32_t i = 0; i < of_a.leaf.n_corners(); ++i)
    for (std::uint32_t j = 0; j < of_b.leaf.n_corners(); ++j) {
      Real square = 0;
      for (int k = 0; k < 3; ++k) {
        const Real d = of_a.at[i][k] - of_b.at[j][k];
        square += d * d;
      }
      if (square < least && are_tested(tree, filter, of_a, i, of_b, j)) least = square, nearest[0] = i, nearest[1] = j;
    }
  if (least == infinity) return std::numeric_limits<double>::infinity();
  const std::array<double, 3> x = position(snapshot, placed, of_a.vertices[nearest[0]]),
                              y = position(snapshot, placed, of_b.vertices[nearest[1]]);
  return std::hypot(x[0] - y[0], x[1] - y[1], x[2] - y[2]);
}

}  // namespace

double distance_of_near_corners(const Tree& tree, const MotionBounds& snapshot, const FineBoxes* fine,
                                const PlacedMeshes* placed, const FilterView* filter, std::uint32_t a,
                                std::uint32_t b) {
  if (fine)
    return distance_of_corners<double>(tree, snapshot, placed, filter, near_leaves(tree, {a, b}, [&](NodePair p) {
                                         return fine->square_of_gap(p.a, p.b);
                                       }));
  return distance_of_corners<float>(tree, snapshot, placed, filter, near_leaves(tree, {a, b}, [&](NodePair p) {
                                      const Node &node_a = tree.nodes[p.a], &node_b = tree.nodes[p.b];
                                      return placed ? placed->at_pose(node_a).square_of_gap(placed->at_pose(node_b))
                                                    : node_a.square_of_gap(node_b);
                                    }));
}

}  // namespace hpccd
