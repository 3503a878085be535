// SPDX-License-Identifier: Apache-2.0
// Results about the nearest features of two meshes: which pairs of meshes are listed, and the points on both sides.
#include "contacts/gaps.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "elementary/exact/distance.h"
#include "elementary/exact/intersection.h"
#include "grid_scene.h"

namespace hpccd {
namespace {

using V = Vec3<double>;

std::vector<Gap> gaps_of(const Scene& scene, const std::vector<V>& positions) {
  Options options;
  options.backend = Backend::cpu, options.threads = 1;
  return Detector(std::make_shared<Scene>(scene), options).distances({positions.data(), positions.size()});
}

V point(const std::array<double, 3>& x) { return {x[0], x[1], x[2]}; }

// An edge (as a face that names a vertex twice) and a face.
Scene edge_and_face() {
  Scene scene;
  scene.add_mesh("edge", std::vector<std::uint32_t>{0, 1, 1}, 2, {.self_collision = false});
  scene.add_mesh("face", std::vector<std::uint32_t>{0, 1, 2}, 3, {.self_collision = false});
  return scene;
}

TEST(Gaps, AreListedByMeshesWithoutThoseThatAreIgnored) {
  Scene scene;
  for (const char* name : {"a", "b", "c"}) scene.add_mesh(name, std::vector<std::uint32_t>{0, 1, 2}, 3, {});
  scene.ignore_pair(2, 0);
  std::vector<V> positions;
  for (int m = 0; m < 3; ++m)
    for (const V& v : {V{0, 0, 0}, V{1, 0, 0}, V{0, 1, 0}}) positions.push_back(v + V{0, 0, 2.0 * m});
  std::vector<std::pair<std::uint32_t, std::uint32_t>> listed;
  for (const Gap& gap : gaps_of(scene, positions)) {
    listed.push_back({gap.mesh_a, gap.mesh_b});
    EXPECT_EQ(gap.distance, gap.mesh_a == gap.mesh_b ? INFINITY : 2) << "a triangle has no pair of its own";
    EXPECT_EQ(gap.kind, gap.mesh_a == gap.mesh_b ? GapKind::none : GapKind::vertex_face);
  }
  EXPECT_EQ(listed, (std::vector<std::pair<std::uint32_t, std::uint32_t>>{{0, 0}, {0, 1}, {1, 1}, {1, 2}, {2, 2}}));
}

TEST(Gaps, PointsAreTheNearestOnesInTheOrderOfTheFeatures) {
  const auto expect = [](const std::vector<V>& positions, GapKind kind, const V& first, const V& second) {
    const std::vector<Gap> gaps = gaps_of(edge_and_face(), positions);
    ASSERT_EQ(gaps.size(), 1u);
    EXPECT_EQ(gaps[0].kind, kind);
    EXPECT_EQ(max_norm(point(gaps[0].points[0]) - first), 0);
    EXPECT_EQ(max_norm(point(gaps[0].points[1]) - second), 0);
  };
  // The end of the edge above the face; a corner beside the edge, which is a face of its mesh too; across; through.
  const V a{0, 0, 0}, b{4, 0, 0}, c{0, 4, 0};
  expect({{1, 1, 2}, {1, 1, 5}, a, b, c}, GapKind::vertex_face, {1, 1, 2}, {1, 1, 0});
  expect({{-3, -8, 0}, {-3, 8, 0}, a, b, {0.0, 4, 1}}, GapKind::vertex_face, {0, 0, 0}, {-3, 0, 0});
  expect({{2, -1, -3}, {2, -1, 3}, a, b, c}, GapKind::edge_edge, {2, -1, 0}, {2, 0, 0});
  expect({{1, 1, -3}, {1, 1, 1}, a, b, c}, GapKind::edge_face, {1, 1, 0}, {1, 1, 0});
}

// Coplanar ones, touching ends and needles among them.
TEST(Gaps, WhereAnEdgeMeetsAFaceThePointsLieOnBoth) {
  std::mt19937_64 random(6);
  int meeting = 0, flat = 0;
  for (int i = 0; i < 4000; ++i) {
    std::vector<V> q(5);
    for (V& v : q)
      for (double* x : {&v.x, &v.y, &v.z}) *x = static_cast<int>(random() % 7) - 3;
    if (i % 3 == 0)
      for (V& v : q) v.z = 0.5 * v.x;
    if (i % 5 == 0)
      for (V& v : q) v = {v.x, 1e-9 * v.y, v.z + 1000};
    if (!exact::intersect(q.data())) continue;
    ++meeting, flat += i % 3 == 0;
    const std::vector<Gap> gaps = gaps_of(edge_and_face(), q);
    ASSERT_EQ(gaps[0].kind, GapKind::edge_face) << "query " << i;
    ASSERT_EQ(gaps[0].distance, 0);
    ASSERT_EQ(gaps[0].features, (std::array<std::uint32_t, 4>{0, 1, 1}));
    const V on_edge[4] = {point(gaps[0].points[0]), q[0], q[1], q[1]};
    const V on_face[4] = {point(gaps[0].points[1]), q[2], q[3], q[4]};
    ASSERT_LE(exact::distance(Kind::vertex_face, on_edge), 1e-12 * 1003) << "query " << i;
    ASSERT_LE(exact::distance(Kind::vertex_face, on_face), 1e-12 * 1003) << "query " << i;
    ASSERT_LE(max_norm(on_edge[0] - on_face[0]), 1e-12 * 1003) << "query " << i;
  }
  EXPECT_GT(meeting, 500);
  EXPECT_GT(flat, 100);
}

struct Nothing {
  std::shared_ptr<const Scene> scene = test::two_sheets(3);
  Features features = features_of(*scene);
  PairRules rules{*scene, Accuracy::exact, SeparationTable(*scene, 0)};
  MeshPairs pairs{rules, scene->meshes().size()};
  MotionBounds motion;
  Tree tree;
  ThicknessTable thickness{*scene, features};
  NearestPairs nearest{pairs, rules, nullptr, features, motion, tree, thickness};
  Cancellation cancellation;

  std::vector<Gap> gaps() const { return collect_gaps(nearest, {}, cancellation); }
};

TEST(Gaps, OneForEachPairOfMeshesWhetherSomethingWasFoundOrNot) {
  const std::vector<Gap> gaps = Nothing().gaps();
  ASSERT_EQ(gaps.size(), 3u);
  for (std::size_t i = 0; i < gaps.size(); ++i) {
    EXPECT_EQ((std::array{gaps[i].mesh_a, gaps[i].mesh_b}), Nothing().pairs[i]);
    EXPECT_EQ(gaps[i].kind, GapKind::none);
    EXPECT_EQ(gaps[i].distance, std::numeric_limits<double>::infinity());
  }
}

TEST(Gaps, AreNotCollectedForOneWhoCancelled) {
  Nothing nothing;
  nothing.cancellation.request();
  EXPECT_THROW(nothing.gaps(), Cancelled);
}

}  // namespace
}  // namespace hpccd
