// SPDX-License-Identifier: Apache-2.0
#include "traverse/fine_boxes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

#include "base/vec3.h"

namespace hpccd {
namespace {

using V = Vec3<double>;

constexpr double infinity = std::numeric_limits<double>::infinity();

// If squares overflow or underflow, boxes count as near.
template <class Box>
double square_between(const Box& a, const Box& b) {
  double square = 0;
  for (int k = 0; k < 3; ++k) {
    const double gap = std::max({a.low[k] - b.high[k], b.low[k] - a.high[k], 0.0});
    square += gap * gap;
  }
  return square;
}

// Gaps, their squares and the sum are rounded.
bool certainly_farther(double square, double distance) { return square * (1 - 1e-14) > distance * distance; }

// Positions of the corners of a leaf, relative to a point near it.
struct LeafCorners {
  std::array<V, CornersOf::most_corners> at;
  std::uint32_t n;
  double largest = 0;  // coordinate

  LeafCorners(const Tree& tree, const MotionBounds& snapshot, const LeafRange& leaf, const double (&origin)[3])
      : n(leaf.n_corners()) {
    for (std::uint32_t i = 0; i < n; ++i) {
      const double* x = snapshot.vertices[tree.corners[leaf.first_corner + i]].t0;
      at[i] = {x[0] - origin[0], x[1] - origin[1], x[2] - origin[2]};
      largest = std::max({largest, std::fabs(at[i].x), std::fabs(at[i].y), std::fabs(at[i].z)});
    }
  }
  const V& farthest(const V& along) const {
    return *std::max_element(at.begin(), at.begin() + n,
                             [&](const V& a, const V& b) { return dot(a, along) < dot(b, along); });
  }
};

// The direction along which two leaves are far apart (Gilbert 1966, as in leaf_hulls.cpp): a unit vector from a to b,
// or zero if they may touch.
struct Direction {
  V along{0, 0, 0};
  bool apart = false;  // by more than the distance
};

Direction direction_between(const LeafCorners& a, const LeafCorners& b, double distance) {
  constexpr int most_steps = 8;
  Direction best;
  double most = 0;
  V v = b.at[0] - a.at[0];
  for (int step = 0; step < most_steps; ++step) {
    const double length = std::sqrt(dot(v, v));
    if (!(length > 0 && length < infinity)) return best;
    const V along = (1 / length) * v;
    const V difference = b.farthest(-1.0 * along) - a.farthest(along);
    const double gap = dot(difference, along);
    if (gap > most) most = gap, best.along = along;
    if (gap > distance) return {along, true};
    const V way = difference - v;
    const double square = dot(way, way), part = -dot(v, way);
    if (!(part > 1e-12 * square)) return best;
    v = v + std::fmin(part / square, 1.0) * way;
  }
  return best;
}

struct FeatureBounds {
  double low[3] = {infinity, infinity, infinity}, high[3] = {-infinity, -infinity, -infinity};
  double nearest = infinity, farthest = -infinity;  // along the direction
  std::array<std::uint32_t, 3> vertices;
  std::uint32_t n_vertices = 0, number = 0;

  bool shares_vertex(const FeatureBounds& other) const {
    for (std::uint32_t i = 0; i < n_vertices; ++i)
      for (std::uint32_t j = 0; j < other.n_vertices; ++j)
        if (vertices[i] == other.vertices[j]) return true;
    return false;
  }
};

// The features of one kind of a leaf.
struct FeatureList {
  std::array<FeatureBounds, 3 * Tree::leaf_size> of;
  std::uint32_t n = 0;
  std::span<const FeatureBounds> all() const { return {of.data(), n}; }

  // corner(j, i): corner j of feature i.
  template <class Corner>
  void fill(const Tree& tree, const LeafRange& leaf, const LeafCorners& corners, const V& along,
            std::span<const std::uint32_t> numbers, std::uint32_t n_vertices, Corner&& corner) {
    n = static_cast<std::uint32_t>(numbers.size());
    for (std::uint32_t i = 0; i < n; ++i) {
      FeatureBounds& f = of[i] = {};
      f.number = numbers[i], f.n_vertices = n_vertices;
      for (std::uint32_t j = 0; j < n_vertices; ++j) {
        const std::uint32_t c = corner(j, i);
        const V& x = corners.at[c];
        const double at[3] = {x.x, x.y, x.z}, place = dot(x, along);
        for (int k = 0; k < 3; ++k) f.low[k] = std::min(f.low[k], at[k]), f.high[k] = std::max(f.high[k], at[k]);
        f.nearest = std::min(f.nearest, place), f.farthest = std::max(f.farthest, place);
        f.vertices[j] = tree.corners[leaf.first_corner + c];
      }
    }
  }
};

struct LeafFeatures {
  FeatureList edges, faces, vertices;

  LeafFeatures(const Tree& tree, const LeafRange& leaf, const LeafCorners& corners, const V& along) {
    const CornersOf& in = tree.corners_of[static_cast<std::size_t>(&leaf - tree.leaves.data())];
    edges.fill(tree, leaf, corners, along, {&tree.edge_of_slot[leaf.first_edge], leaf.n_edges()}, 2,
               [&](std::uint32_t j, std::uint32_t i) { return in.edge[j][i]; });
    faces.fill(tree, leaf, corners, along, {&tree.face_of_slot[leaf.first_face], leaf.n_faces()}, 3,
               [&](std::uint32_t j, std::uint32_t i) { return in.face[j][i]; });
    vertices.fill(tree, leaf, corners, along, {&tree.corners[leaf.first_corner], leaf.n_vertices()}, 1,
                  [](std::uint32_t, std::uint32_t i) { return i; });
  }
};

void add(CandidateBuffer& out, std::uint32_t first, std::uint32_t second) {
  out.first[out.n] = first, out.second[out.n] = second;
  ++out.n;
}

}  // namespace

FineBoxes::FineBoxes(const Tree& tree, const MotionBounds& snapshot)
    : tree_(tree), snapshot_(snapshot), nodes_(tree.nodes.size()) {
  for (std::size_t i = tree.nodes.size(); i-- > 0;) {  // children are after their parents
    Bounds& box = nodes_[i] = {{infinity, infinity, infinity}, {-infinity, -infinity, -infinity}};
    const auto include = [&](const double* low, const double* high) {
      for (int k = 0; k < 3; ++k)
        box.low[k] = std::min(box.low[k], low[k]), box.high[k] = std::max(box.high[k], high[k]);
    };
    const Node& node = tree.nodes[i];
    if (node.children) {
      for (std::uint32_t j = 0; j < 2; ++j) include(nodes_[node.children + j].low, nodes_[node.children + j].high);
      continue;
    }
    const LeafRange& leaf = tree.leaves[node.leaf];
    for (std::uint32_t c = leaf.first_corner; c < leaf.end_corner; ++c) {
      const VertexMotion& x = snapshot.vertices[tree.corners[c]];
      include(x.t0, x.t0);
    }
  }
}

double FineBoxes::square_of_gap(std::uint32_t a, std::uint32_t b) const { return square_between(nodes_[a], nodes_[b]); }

bool FineBoxes::farther_apart(std::uint32_t a, std::uint32_t b, double distance) const {
  return certainly_farther(square_of_gap(a, b), distance);
}

void FineBoxes::add_near(const LeafRange& a, const LeafRange& b, double distance, CandidateBuffer& edge_edge,
                         CandidateBuffer& vertex_face) const {
  const bool same = &a == &b;
  const Bounds& box = nodes_[tree_.leaf_nodes[static_cast<std::size_t>(&a - tree_.leaves.data())]];
  const LeafCorners corners_a(tree_, snapshot_, a, box.low), corners_b(tree_, snapshot_, b, box.low);
  // Differences of coordinates, products with a unit vector and their sums each have a relative error of 1.1e-16.
  const double reach = distance * (1 + 1e-14) + 4e-15 * (corners_a.largest + corners_b.largest);
  const Direction direction = same ? Direction() : direction_between(corners_a, corners_b, reach);
  if (direction.apart) return;
  const auto near = [&](const FeatureBounds& f, const FeatureBounds& g) {
    return !(g.nearest - f.farthest > reach) && !certainly_farther(square_between(f, g), reach) && !f.shares_vertex(g);
  };
  const LeafFeatures of_a(tree_, a, corners_a, direction.along), of_b(tree_, b, corners_b, direction.along);
  for (const FeatureBounds& f : of_a.edges.all())
    for (const FeatureBounds& g : of_b.edges.all())
      if ((!same || f.number < g.number) && near(f, g))
        add(edge_edge, std::min(f.number, g.number), std::max(f.number, g.number));
  for (const FeatureBounds& f : of_a.vertices.all())
    for (const FeatureBounds& g : of_b.faces.all())
      if (near(f, g)) add(vertex_face, f.number, g.number);
  if (same) return;
  for (const FeatureBounds& g : of_b.vertices.all())
    for (const FeatureBounds& f : of_a.faces.all())
      if (near(f, g)) add(vertex_face, g.number, f.number);
}

}  // namespace hpccd
