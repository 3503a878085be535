// SPDX-License-Identifier: Apache-2.0
#include "scene/features.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "grid_scene.h"

namespace hpccd {
namespace {

constexpr std::uint32_t side = 9, lone = 2;

TEST(Features, EdgesAreUniqueOrderedAndThoseOfTheTriangles) {
  const auto scene = test::two_sheets(side, lone);
  const Features features = features_of(*scene);
  std::set<std::array<std::uint32_t, 2>> expected;
  for (const auto& face : scene->faces())
    for (int k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax(face[k], face[(k + 1) % 3]);
      expected.insert({low, high});
    }
  EXPECT_EQ(features.edges, (std::vector<std::array<std::uint32_t, 2>>(expected.begin(), expected.end())));
}

// "Each feature assigned to one triangle" (Kim et al. 2009, section 6) is what makes every pair tested once.
TEST(Features, EachFeatureIsRepresentedOnceByATriangleThatHasIt) {
  const auto scene = test::two_sheets(side, lone);
  const Features features = features_of(*scene);
  std::vector<int> edge_owners(features.edges.size()), vertex_owners(scene->n_vertices());
  for (std::uint32_t primitive = 0; primitive < features.n_primitives(); ++primitive) {
    const bool is_face = primitive < features.n_faces();
    for (auto i = features.first_edge[primitive]; i < features.first_edge[primitive + 1]; ++i) {
      const std::uint32_t edge = features.owned_edges[i];
      ++edge_owners[edge];
      ASSERT_TRUE(is_face);
      for (std::uint32_t end : features.edges[edge])
        EXPECT_EQ(std::ranges::count(features.faces[primitive], end), 1) << "edge " << edge << ", face " << primitive;
    }
    for (auto i = features.first_vertex[primitive]; i < features.first_vertex[primitive + 1]; ++i) {
      const std::uint32_t vertex = features.owned_vertices[i];
      ++vertex_owners[vertex];
      if (is_face) {
        EXPECT_EQ(std::ranges::count(features.faces[primitive], vertex), 1);
      } else {
        EXPECT_EQ(features.lone_vertices[primitive - features.n_faces()], vertex);
      }
    }
  }
  EXPECT_EQ(edge_owners, std::vector<int>(features.edges.size(), 1));
  EXPECT_EQ(vertex_owners, std::vector<int>(scene->n_vertices(), 1));
  EXPECT_EQ(features.lone_vertices.size(), lone * test::sheets);
}

TEST(Features, GivenEdgesThatAreInNoTriangleAreRepresentedByThemselves) {
  Scene scene;
  const std::uint32_t triangle[] = {2, 1, 0}, edges[] = {3, 2, 0, 1, 4, 4, 5, 3, 2, 3, 2, 0}, rope[] = {1, 0, 1, 2};
  scene.add_mesh("fringed", triangle, 7, {}, edges);
  scene.add_mesh("rope", {}, 3, {}, rope);
  const Features x = features_of(scene);
  EXPECT_EQ(x.edges,
            (std::vector<std::array<std::uint32_t, 2>>{{0, 1}, {0, 2}, {1, 2}, {2, 3}, {3, 5}, {7, 8}, {8, 9}}));
  EXPECT_EQ(x.lone_edges, (std::vector<std::array<std::uint32_t, 2>>{{2, 3}, {3, 5}, {7, 8}, {8, 9}}));
  EXPECT_EQ(x.lone_vertices, (std::vector<std::uint32_t>{4, 6}));
  EXPECT_EQ(x.mesh_of_primitive, (std::vector<std::uint32_t>{0, 0, 0, 1, 1, 0, 0}));
  EXPECT_EQ(x.first_edge, (std::vector<std::uint32_t>{0, 3, 4, 5, 6, 7, 7, 7}));
  EXPECT_EQ(x.owned_edges, (std::vector<std::uint32_t>{0, 1, 2, 3, 4, 5, 6}));
  EXPECT_EQ(x.first_vertex, (std::vector<std::uint32_t>{0, 3, 4, 5, 7, 8, 9, 10}));
  EXPECT_EQ(x.owned_vertices, (std::vector<std::uint32_t>{0, 1, 2, 3, 5, 7, 8, 9, 4, 6}));
}

TEST(Features, KnowTheMeshOfEachVertex) {
  Scene scene;
  const std::uint32_t triangle[] = {0, 1, 2};
  scene.add_mesh("points", {}, 2, {});
  scene.add_mesh("nothing", {}, 0, {});
  scene.add_mesh("triangle and a point", triangle, 4, {});
  EXPECT_EQ(features_of(scene).mesh_of_vertex, (std::vector<std::uint32_t>{0, 0, 2, 2, 2, 2}));
}

TEST(Features, AreTheSameWithAnyNumberOfThreads) {
  for (const std::uint32_t n : {2u, 3u, side, 80u}) {
    auto scene = std::make_shared<Scene>(*test::two_sheets(n, lone));
    const std::uint32_t threads[] = {n * n, 0, 1, 0, n * n, 1};
    scene->add_mesh("none", {}, 0, {});
    scene->add_mesh("fringed", test::sheet_faces(n), n * n + 2, {}, threads);
    const Features alone = features_of(*scene);
    for (int threads : {2, 3, 16}) {
      ThreadPool pool(threads);
      const Features shared = features_of(*scene, pool);
      EXPECT_EQ(alone.edges, shared.edges);
      EXPECT_EQ(alone.first_edge, shared.first_edge);
      EXPECT_EQ(alone.owned_edges, shared.owned_edges);
      EXPECT_EQ(alone.first_vertex, shared.first_vertex);
      EXPECT_EQ(alone.owned_vertices, shared.owned_vertices);
      EXPECT_EQ(alone.lone_edges, shared.lone_edges);
      EXPECT_EQ(alone.lone_vertices, shared.lone_vertices);
      EXPECT_EQ(alone.mesh_of_primitive, shared.mesh_of_primitive);
    }
  }
}

}  // namespace
}  // namespace hpccd
