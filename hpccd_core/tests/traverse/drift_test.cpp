// SPDX-License-Identifier: Apache-2.0
// The remainder that a list of near pairs leaves to the search: never too little, against all contacts, and little
// where neighbours go the same way.
#include "traverse/drift.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "bvh/motion_bounds.h"
#include "grid_scene.h"

namespace hpccd {
namespace {

struct DriftOfSheets : testing::Test {
  static constexpr std::uint32_t side = 21;
  std::shared_ptr<const Scene> scene = test::two_sheets(side);
  Features features = features_of(*scene);
  ThreadPool pool{2};
  std::vector<double> snapshot = test::sheet_positions(side, 0);
  std::vector<Vec3<double>> places;
  MotionBounds bounds;
  Tree tree;
  Drift drift;

  DriftOfSheets() {
    for (std::size_t i = 0; i < snapshot.size(); i += 3)
      places.push_back({snapshot[i], snapshot[i + 1], snapshot[i + 2]});
    bounds.update(test::view(snapshot), test::view(snapshot), pool);
    build(tree, *scene, features, bounds, pool);
    drift.begin(tree, places, pool);
  }

  void see(const std::vector<double>& start, const std::vector<double>& end, double distance, double separation) {
    bounds.update(test::view(start), test::view(end), pool);
    drift.fit(tree, bounds.vertices, places, pool);
    drift.listed_within(distance, separation);
  }
  std::size_t open(float until) const {
    std::size_t n = 0;
    for (const std::uint32_t a : tree.leaf_nodes)
      for (const std::uint32_t b : tree.leaf_nodes) n += a <= b && drift.may_touch(a, b, until);
    return n;
  }
  // A motion of both sheets, in waves that are the shorter the larger their number.
  static std::vector<double> moved(std::vector<double> x, double size, double waves, std::array<double, 3> way) {
    for (std::size_t i = 0; i < x.size(); i += 3) {
      const double wave =
          size * std::sin(waves * x[i] + 1.3 * x[i + 1] * waves + 0.4 * static_cast<double>(i % 7 == 0));
      for (std::size_t k = 0; k < 3; ++k) x[i + k] += way[k] + wave * (k == 2 ? 1 : 0.3);
    }
    return x;
  }
};

TEST_F(DriftOfSheets, NoContactIsInLeavesThatAreClosed) {
  std::map<std::uint32_t, std::uint32_t> leaf_of_face, leaf_of_vertex;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> leaf_of_edge;
  for (const std::uint32_t node : tree.leaf_nodes) {
    const LeafRange& leaf = tree.leaves[tree.nodes[node].leaf];
    for (auto s = leaf.first_face; s < leaf.end_face; ++s) leaf_of_face[tree.face_of_slot[s]] = node;
    for (auto s = leaf.first_vertex; s < leaf.end_vertex; ++s) leaf_of_vertex[tree.vertex_of_slot[s]] = node;
    for (auto s = leaf.first_edge; s < leaf.end_edge; ++s) {
      const auto [a, b] = features.edges[tree.edge_of_slot[s]];
      leaf_of_edge[{a, b}] = node;
    }
  }
  std::size_t n_looked_at = 0, n_closed = 0;
  for (const double separation : {0.0, 0.05}) {
    Detector d(scene, {.backend = Backend::cpu, .minimum_separation = separation});
    for (const double distance : {0.02, 0.1, 0.3, 0.6})
      for (const double waves : {0.05, 0.6, 2.0})
        for (const double size : {0.1, 0.5, 2.0}) {
          const auto start = moved(snapshot, 0.2 * size, waves, {0, 0, 0.1});
          const auto end = moved(start, size, 1.1 * waves, {3, 1, -1});
          const Contacts all = d.detect(test::view(start), test::view(end));
          const Proximity near = d.proximity(test::view(snapshot), distance + separation);
          std::set<std::array<std::uint32_t, 2>> near_faces(near.vf.begin(), near.vf.end());
          std::set<std::array<std::uint32_t, 4>> near_edges(near.ee.begin(), near.ee.end());
          see(start, end, distance, separation);
          for (std::size_t i = 0; i < all.vf.size(); ++i) {
            if (near_faces.contains(all.vf[i])) continue;
            const auto a = leaf_of_vertex.at(all.vf[i][0]), b = leaf_of_face.at(all.vf[i][1]);
            ++n_looked_at;
            EXPECT_TRUE(drift.may_touch(a, b, std::min(1.0f, static_cast<float>(all.vf_toc[i]) * (1 + 1e-6f))));
          }
          for (std::size_t i = 0; i < all.ee.size(); ++i) {
            if (near_edges.contains(all.ee[i])) continue;
            const auto a = leaf_of_edge.at({all.ee[i][0], all.ee[i][1]}),
                       b = leaf_of_edge.at({all.ee[i][2], all.ee[i][3]});
            ++n_looked_at;
            EXPECT_TRUE(drift.may_touch(a, b, std::min(1.0f, static_cast<float>(all.ee_toc[i]) * (1 + 1e-6f))));
          }
          n_closed += tree.leaf_nodes.size() * (tree.leaf_nodes.size() + 1) / 2 - open(1);
        }
  }
  EXPECT_GT(n_looked_at, 10000u);
  EXPECT_GT(n_closed, 10000u);
}

// A triangle that comes towards another, slanted by way[k] along each axis: a list of what goes apart by less than the
// whole way leaves it open, and so does a gap that is shorter than the way along every axis.
TEST(Drift, IsOpenFromTheWayOnThatItTakes) {
  const auto scene = std::make_shared<Scene>();
  for (const char* name : {"still", "moved"}) scene->add_mesh(name, std::vector<std::uint32_t>{0, 1, 2}, 3, {});
  const Features features = features_of(*scene);
  ThreadPool pool{1};
  const std::vector<double> corners{0, 0, 0, 1, 0, 0, 0, 1, 0};
  const double gap = 0.25, way[3] = {0.3, -0.2, -0.6}, length = std::sqrt(0.3 * 0.3 + 0.2 * 0.2 + 0.6 * 0.6);
  const auto at = [&](double t) {
    auto x = corners;
    for (std::size_t i = 0; i < corners.size(); ++i) x.push_back(corners[i] + (i % 3 == 2 ? gap : 0) + t * way[i % 3]);
    return x;
  };
  const auto start = at(0);
  std::vector<Vec3<double>> places;
  for (std::size_t i = 0; i < start.size(); i += 3) places.push_back({start[i], start[i + 1], start[i + 2]});
  MotionBounds bounds;
  bounds.update(test::view(start), test::view(start), pool);
  Tree tree;
  build(tree, *scene, features, bounds, pool);
  Drift drift;
  drift.begin(tree, places, pool);
  ASSERT_EQ(tree.leaf_nodes.size(), 2u);
  const auto open = [&](double end, double listed, double separation, float until) {
    bounds.update(test::view(start), test::view(at(end)), pool);
    drift.fit(tree, bounds.vertices, places, pool);
    drift.listed_within(listed, separation);
    return drift.may_touch(tree.leaf_nodes[0], tree.leaf_nodes[1], until);
  };
  const double touches = gap / 0.6;
  for (const double more : {1e-4, 1e-2, 0.1}) {
    EXPECT_TRUE(open(1, length * (1 - more), 0, 1));
    EXPECT_FALSE(open(1, length * (1 + more), 0, 1));
    EXPECT_TRUE(open(1, 0.6 * length * (1 - more), 0, 0.6f));
    EXPECT_FALSE(open(1, 0.6 * length * (1 + more), 0, 0.6f));
    EXPECT_TRUE(open(touches * (1 + more), 0, 0, 1));
    EXPECT_FALSE(open(touches * (1 - more), 0, 0, 1));
    EXPECT_TRUE(open(1, 0, 0, static_cast<float>(touches * (1 + more))));
    EXPECT_FALSE(open(1, 0, 0, static_cast<float>(touches * (1 - more))));
    EXPECT_TRUE(open(0, 0, gap * (1 + more), 1));
    EXPECT_FALSE(open(0, 0, gap * (1 - more), 1));
  }
}

TEST_F(DriftOfSheets, WhatFallsAsAWholeLeavesNothingOpen) {
  see(snapshot, moved(snapshot, 0, 0, {5, -3, 40}), 0.1, 0);
  EXPECT_EQ(open(1), 0u);
  EXPECT_FALSE(drift.may_touch(0, 0, 1));
}

TEST_F(DriftOfSheets, TheLessOfAMotionTheLessIsOpen) {
  see(snapshot, moved(snapshot, 1, 0.6, {5, -3, 40}), 0.1, 0);
  std::size_t last = open(1);
  EXPECT_GT(last, 10u);
  for (const float until : {0.5f, 0.1f, 0.01f}) {
    EXPECT_LT(open(until), last);
    last = open(until);
  }
  EXPECT_EQ(last, 0u);
}

TEST_F(DriftOfSheets, ANodeIsOpenWhereItsChildrenAre) {
  see(snapshot, moved(snapshot, 0.7, 0.6, {5, -3, 40}), 0.1, 0);
  for (std::uint32_t a = 0; a < tree.nodes.size(); ++a)
    for (std::uint32_t b = 0; b < tree.nodes.size(); b += 5)
      if (tree.nodes[a].children && a != b && drift.may_touch(tree.nodes[a].children, b, 0.7f))
        EXPECT_TRUE(drift.may_touch(a, b, 0.7f));
}

TEST_F(DriftOfSheets, WaysBeyondAllNumbersLeaveAllOpen) {
  auto far = snapshot;
  far[4] = 1e100;
  see(snapshot, far, 0.1, 0);
  EXPECT_TRUE(drift.may_touch(0, 0, 1));
  for (const std::uint32_t node : tree.leaf_nodes) EXPECT_TRUE(drift.may_touch(node, node, 1)) << node;
}

}  // namespace
}  // namespace hpccd
