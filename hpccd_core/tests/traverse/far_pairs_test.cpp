// SPDX-License-Identifier: Apache-2.0
// The filter of pairs of features that are far apart drops none within the reach, by integers, and drops the same
// with every instruction set.
#include "traverse/far_pairs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <set>

#include "base/simd.h"
#include "bvh/motion_bounds.h"
#include "elementary/exact/distance.h"
#include "grid_scene.h"
#include "soup_scene.h"
#include "traverse/leaf_hulls.h"
#include "traverse/near_corners.h"

namespace hpccd {
namespace {

using V = Vec3<double>;
using Pair = std::pair<std::uint32_t, std::uint32_t>;

struct Found {
  std::set<Pair> edge_edge, vertex_face;
  bool operator==(const Found&) const = default;
};

struct Measured {
  double distance;
  Kind kind;
  Pair pair;
};

// Two meshes of a scene, the second one moved.
struct TwoMeshes {
  std::shared_ptr<const Scene> scene;
  Features features = features_of(*scene);
  ThreadPool pool{1};
  MotionBounds motion;
  Tree tree;

  TwoMeshes(std::shared_ptr<const Scene> s, std::vector<double> positions, const V& shift, double scale)
      : scene(std::move(s)) {
    const std::uint32_t second = scene->meshes()[1].first_vertex;
    for (std::uint32_t i = 0; i < positions.size(); ++i) {
      const double by[3] = {shift.x, shift.y, shift.z};
      positions[i] = scale * (positions[i] + (i / 3 >= second ? by[i % 3] : 0));
    }
    motion.update(*scene, {positions.data(), positions.size() / 3}, pool);
    build(tree, *scene, features, motion, pool);
  }

  V at(std::uint32_t v) const { return {motion.vertices[v].t0[0], motion.vertices[v].t0[1], motion.vertices[v].t0[2]}; }

  // All pairs of features of two leaves.
  std::vector<Measured> measured(const LeafRange& a, const LeafRange& b) const {
    std::vector<Measured> all;
    for (auto i = a.first_edge; i < a.end_edge; ++i)
      for (auto j = b.first_edge; j < b.end_edge; ++j) {
        const Pair p = std::minmax(tree.edge_of_slot[i], tree.edge_of_slot[j]);
        const auto &x = features.edges[p.first], &y = features.edges[p.second];
        const V q[4] = {at(x[0]), at(x[1]), at(y[0]), at(y[1])};
        all.push_back({exact::distance(Kind::edge_edge, q), Kind::edge_edge, p});
      }
    for (const auto& [of, other] : {std::pair(&a, &b), std::pair(&b, &a)})
      for (auto i = of->first_vertex; i < of->end_vertex; ++i)
        for (auto j = other->first_face; j < other->end_face; ++j) {
          const Pair p{tree.vertex_of_slot[i], tree.face_of_slot[j]};
          const auto& f = features.faces[p.second];
          const V q[4] = {at(p.first), at(f[0]), at(f[1]), at(f[2])};
          all.push_back({exact::distance(Kind::vertex_face, q), Kind::vertex_face, p});
        }
    return all;
  }

  Found by(Simd simd, const LeafRange& a, const LeafRange& b, float reach) const {
    const auto edge_edge = std::make_unique<CandidateBuffer>(), vertex_face = std::make_unique<CandidateBuffer>();
    far_pairs(simd)(tree, a, b, TestedFeatures{}, reach, *edge_edge, *vertex_face);
    Found found;
    for (std::uint32_t i = 0; i < edge_edge->n; ++i)
      found.edge_edge.insert({edge_edge->first[i], edge_edge->second[i]});
    for (std::uint32_t i = 0; i < vertex_face->n; ++i)
      found.vertex_face.insert({vertex_face->first[i], vertex_face->second[i]});
    EXPECT_EQ(found.edge_edge.size(), edge_edge->n);
    EXPECT_EQ(found.vertex_face.size(), vertex_face->n);
    return found;
  }

  // Pairs of leaves of both meshes.
  template <class Function>
  void each(Function&& f) const {
    for (std::size_t x = 0; x < tree.leaves.size(); ++x)
      for (std::size_t y = 0; y < tree.leaves.size(); ++y)
        if (tree.nodes[tree.leaf_nodes[x]].mesh == 0 && tree.nodes[tree.leaf_nodes[y]].mesh == 1)
          f(tree.leaves[x], tree.leaves[y], tree.nodes[tree.leaf_nodes[x]], tree.nodes[tree.leaf_nodes[y]]);
  }

  // A node that holds a whole mesh, or its topmost one.
  std::uint32_t top(std::uint32_t mesh) const {
    const auto of = [&](const Node& node) { return node.mesh == mesh; };
    return static_cast<std::uint32_t>(std::ranges::find_if(tree.nodes, of) - tree.nodes.begin());
  }
};

constexpr std::uint32_t triangles = 24;
constexpr V shifts[] = {{0.5, 0.2, 0.1}, {7, 0, 0}, {9, -8, 7}, {0, 3e3, -2e3}};
constexpr double scales[] = {1, 0x1p300, 0x1p-300};

TEST(FarPairs, NoneIsMissedThatIsWithinTheReach) {
  std::size_t all = 0, kept = 0, leaves = 0, leaves_apart = 0;
  for (const V& shift : shifts)
    for (const double scale : scales) {
      const TwoMeshes m(test::soup_scene(triangles), test::soup_positions(triangles, 1), shift, scale);
      m.each([&](const LeafRange& a, const LeafRange& b, const Node& node_a, const Node& node_b) {
        std::vector<Measured> pairs = m.measured(a, b);
        std::ranges::sort(pairs, {}, &Measured::distance);
        // Just as far as some of them, and a little nearer than all.
        for (const double distance : {0.99 * pairs[0].distance, pairs[0].distance, pairs[pairs.size() / 10].distance}) {
          const float reach = reach_of(distance, m.motion.rounding, m.motion.map.scale);
          const Found found = m.by(Simd::scalar, a, b, reach);
          for (const Simd simd : simd_levels()) EXPECT_EQ(m.by(simd, a, b, reach), found) << name_of(simd);
          if (pairs[0].distance <= distance) {
            EXPECT_FALSE(farther_apart(m.tree, a, b, reach)) << distance;
            EXPECT_LE(node_a.square_of_gap(node_b), reach * reach) << distance;
          }
          for (const Measured& p : pairs) {
            if (p.distance > distance) break;
            EXPECT_TRUE((p.kind == Kind::edge_edge ? found.edge_edge : found.vertex_face).contains(p.pair))
                << p.pair.first << " " << p.pair.second << " within " << distance;
          }
          all += pairs.size(), kept += found.edge_edge.size() + found.vertex_face.size();
          ++leaves, leaves_apart += farther_apart(m.tree, a, b, reach);
        }
      });
    }
  EXPECT_LT(kept, all / 4);
  EXPECT_GT(leaves_apart, leaves / 8);
}

TEST(FarPairs, LeavesShareAVertexIfOneIsACornerOfBoth) {
  const TwoMeshes m(test::two_sheets(20), test::sheet_positions(20, 0), {}, 1);
  std::size_t sharing = 0;
  for (const LeafRange& a : m.tree.leaves)
    for (const LeafRange& b : m.tree.leaves) {
      const auto corners = [&](const LeafRange& leaf) {
        return std::set(m.tree.corners.begin() + leaf.first_corner, m.tree.corners.begin() + leaf.end_corner);
      };
      const std::set<std::uint32_t> of_a = corners(a), of_b = corners(b);
      const bool share = std::ranges::any_of(of_a, [&](std::uint32_t v) { return of_b.contains(v); });
      EXPECT_EQ(share_a_vertex(m.tree, a, b), share);
      sharing += share;
    }
  const std::size_t n = m.tree.leaves.size();
  EXPECT_GT(sharing, 3 * n);
  EXPECT_LT(sharing, n * n / 2);
}

TEST(FarPairs, NearCornersAreNoNearerThanTheMeshes) {
  for (const V& shift : shifts)
    for (const double scale : scales) {
      const TwoMeshes m(test::soup_scene(triangles), test::soup_positions(triangles, 1), shift, scale);
      double least = INFINITY;
      m.each([&](const LeafRange& a, const LeafRange& b, const Node&, const Node&) {
        for (const Measured& p : m.measured(a, b)) least = std::min(least, p.distance);
      });
      const double found = distance_of_near_corners(m.tree, m.motion, nullptr, nullptr, nullptr, m.top(0), m.top(1));
      EXPECT_GE(found, least * (1 - 1e-15));
      EXPECT_LE(found, least + 7 * scale);
    }
}

// Points are tested against faces alone.
TEST(FarPairs, CornersWithoutFeaturesThatAreTestedTellNothing) {
  const auto corners_of = [](bool rope, bool face) {
    auto scene = std::make_shared<Scene>();
    scene->add_mesh("points", std::vector<std::uint32_t>{}, 3, {});
    std::vector<std::uint32_t> faces, edges;
    if (face) faces = {0, 1, 2};
    if (rope) edges = {0, 1, 1, 2};
    scene->add_mesh("other", faces, 3, {}, edges);
    const TwoMeshes m(scene, {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 1, 0}, {0, 0, 2}, 1);
    return distance_of_near_corners(m.tree, m.motion, nullptr, nullptr, nullptr, m.top(0), m.top(1));
  };
  EXPECT_EQ(corners_of(false, true), 2);
  EXPECT_EQ(corners_of(true, false), INFINITY);
}

// Where gaps are so small that their squares vanish, nothing is left out.
TEST(FarPairs, BesideTheMiddleOfTheScene) {
  auto scene = std::make_shared<Scene>();
  for (const char* name : {"a", "b"}) scene->add_mesh(name, std::vector<std::uint32_t>{0, 1, 2}, 3, {});
  for (double gap = 1e-18; gap > 1e-26; gap /= 1.5) {
    // In opposite corners of the scene, apart along the diagonal, where their boxes nearly touch.
    const double x = 2, e = gap;
    const TwoMeshes m(scene, {-x, -e, -e, -e, -x, -e, -e, -e, -x, x, e, e, e, x, e, e, e, x}, {0, 0, 0}, 1);
    m.each([&](const LeafRange& a, const LeafRange& b, const Node&, const Node&) {
      for (const Measured& p : m.measured(a, b)) {
        const float reach = reach_of(p.distance, m.motion.rounding, m.motion.map.scale);
        const Found found = m.by(Simd::scalar, a, b, reach);
        EXPECT_TRUE((p.kind == Kind::edge_edge ? found.edge_edge : found.vertex_face).contains(p.pair)) << gap;
        EXPECT_FALSE(farther_apart(m.tree, a, b, reach));
      }
    });
  }
}

}  // namespace
}  // namespace hpccd
