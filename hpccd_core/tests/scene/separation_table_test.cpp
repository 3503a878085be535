// SPDX-License-Identifier: Apache-2.0
// The separations of pairs of meshes: what the scene says, else the detector; changed later; the largest of each mesh.
#include "scene/separation_table.h"

#include <gtest/gtest.h>

#include <set>

namespace hpccd {
namespace {

// Meshes of one triangle each.
Scene scene_of(std::uint32_t n_meshes) {
  Scene scene;
  for (std::uint32_t m = 0; m < n_meshes; ++m)
    scene.add_mesh("mesh" + std::to_string(m), std::vector<std::uint32_t>{0, 1, 2}, 3, {});
  return scene;
}

TEST(SeparationTable, OfAPairIsWhatTheSceneSaysElseTheDetector) {
  Scene scene = scene_of(3);
  scene.set_separation(2, 0, 0.5);
  scene.set_separation(1, 1, 0);
  const SeparationTable table(scene, 0.125);
  EXPECT_EQ(table.of(0, 2), 0.5);
  EXPECT_EQ(table.of(2, 0), 0.5);
  EXPECT_EQ(table.of(1, 1), 0);
  for (const auto& [a, b] : {std::pair{0u, 0u}, {0u, 1u}, {1u, 2u}, {2u, 1u}, {2u, 2u}})
    EXPECT_EQ(table.of(a, b), 0.125) << a << " and " << b;
  EXPECT_EQ(table.most(), 0.5);
  EXPECT_TRUE(table.any());
  EXPECT_FALSE(table.uniform());
}

TEST(SeparationTable, OfAChangedPairIsTheLastInBothOrders) {
  const Scene scene = scene_of(3);
  SeparationTable table(scene, 0.25);
  table.set(2, 1, 1);
  table.set(1, 2, 0.75);
  table.settle();
  EXPECT_EQ(table.of(1, 2), 0.75);
  EXPECT_EQ(table.of(2, 1), 0.75);
  EXPECT_EQ(table.of(1, 1), 0.25);
  EXPECT_EQ(table.of(2, 2), 0.25);
}

TEST(SeparationTable, UniformIsWhereAllPairsAreTheSame) {
  const Scene scene = scene_of(2);
  SeparationTable table(scene, 0.25);
  EXPECT_TRUE(table.uniform());
  EXPECT_EQ(table.first(), 0.25);
  table.set(0, 1, 0.5);
  table.settle();
  EXPECT_FALSE(table.uniform());
  table.set(0, 0, 0.5);
  table.settle();
  EXPECT_FALSE(table.uniform());
  table.set(1, 1, 0.5);
  table.settle();
  EXPECT_TRUE(table.uniform());
  EXPECT_EQ(table.first(), 0.5);
}

TEST(SeparationTable, WithoutAnySeparationNothingGrows) {
  const Scene scene = scene_of(2);
  SeparationTable table(scene, 0);
  EXPECT_FALSE(table.any());
  EXPECT_TRUE(table.uniform());
  EXPECT_TRUE(table.largest().empty());
  EXPECT_EQ(table.most(), 0);
  table.set(1, 1, 0.5);
  table.settle();
  EXPECT_TRUE(table.any());
  EXPECT_EQ(table.most(), 0.5);
  table.set(1, 1, 0);
  table.settle();
  EXPECT_FALSE(table.any());
  EXPECT_TRUE(table.largest().empty());
}

// Boxes of a mesh grow by this: by no less than any of its pairs needs.
TEST(SeparationTable, LargestOfEachMeshCoversAllItsPairs) {
  Scene scene = scene_of(4);
  scene.set_separation(0, 3, 2);
  scene.set_separation(1, 2, 0);
  SeparationTable table(scene, 0.5);
  const auto expect_covered = [&] {
    ASSERT_EQ(table.largest().size(), 4u);
    for (std::uint32_t a = 0; a < 4; ++a) {
      double largest = 0;
      for (std::uint32_t b = 0; b < 4; ++b) largest = std::max(largest, table.of(a, b));
      EXPECT_EQ(table.largest()[a], largest) << "mesh " << a;
    }
  };
  expect_covered();
  EXPECT_EQ(table.largest(), (std::vector<double>{2, 0.5, 0.5, 2}));
  table.set(1, 2, 3);
  table.settle();
  expect_covered();
  table.set(3, 0, 0.25);  // a pair that was the largest of both
  table.settle();
  expect_covered();
  EXPECT_EQ(table.largest(), (std::vector<double>{0.5, 3, 3, 0.5}));
}

// Pairs that are never tested grow no boxes and invalidate nothing.
TEST(SeparationTable, OfPairsThatAreNeverTestedSaysNothing) {
  Scene scene = scene_of(3);
  scene.add_mesh("table", std::vector<std::uint32_t>{0, 1, 2}, 3, {.is_static = true});
  scene.add_mesh("wall", std::vector<std::uint32_t>{0, 1, 2}, 3, {.self_collision = false, .is_static = true});
  scene.add_mesh("body", std::vector<std::uint32_t>{0, 1, 2}, 3, {.self_collision = false});
  scene.ignore_pair(0, 1);
  scene.set_separation(1, 0, 7);
  SeparationTable table(scene, 0.5);
  const std::uint64_t version = table.version();
  table.set(3, 4, 8);
  table.set(5, 5, 9);
  table.settle();
  EXPECT_EQ(table.of(0, 1), 7);
  EXPECT_EQ(table.of(4, 3), 8);
  EXPECT_EQ(table.most(), 0.5);
  EXPECT_TRUE(table.uniform());
  EXPECT_EQ(table.largest(), std::vector<double>(6, 0.5));
  EXPECT_EQ(table.version(), version);
}

// Beyond PairTable::most_in_table meshes only pairs that were set are stored.
TEST(SeparationTable, OfManyMeshesSaysTheSame) {
  constexpr std::uint32_t n = PairTable<double>::most_in_table + 20;
  Scene scene = scene_of(n);
  std::uint64_t random = 1;
  const auto number = [&](std::uint64_t below) {
    random = random * 6364136223846793005u + 1442695040888963407u;
    return static_cast<std::uint32_t>((random >> 33) % below);
  };
  for (int i = 0; i < 500; ++i) scene.ignore_pair(number(n), number(n));
  SeparationTable table(scene, 0.5);
  std::vector<double> all(n * n, 0.5);
  for (int round = 0; round < 4; ++round) {
    for (int i = 0; i < 700; ++i) {
      const std::uint32_t a = number(n), b = number(round == 1 ? 2 : n);
      all[a * n + b] = all[b * n + a] = 0.25 * number(5);
      table.set(a, b, all[a * n + b]);
    }
    table.settle();
    double most = 0;
    std::set<double> values;
    for (std::uint32_t a = 0; a < n; ++a) {
      double largest = 0;
      for (std::uint32_t b = 0; b < n; ++b) {
        ASSERT_EQ(table.of(a, b), all[a * n + b]) << a << " and " << b;
        if (scene.pair_enabled(a, b)) largest = std::max(largest, all[a * n + b]), values.insert(all[a * n + b]);
      }
      ASSERT_EQ(table.largest()[a], largest) << a;
      most = std::max(most, largest);
    }
    EXPECT_EQ(table.most(), most);
    EXPECT_EQ(table.uniform(), values.size() == 1);
  }
}

TEST(SeparationTable, NoTwoStatesHaveTheSameVersion) {
  const Scene scene = scene_of(2);
  SeparationTable table(scene, 0.5);
  std::set<std::uint64_t> versions{table.version()};
  for (const double d : {0.25, 0.5, 0.0, 0.25}) {
    table.set(0, 1, d);
    EXPECT_TRUE(versions.insert(table.version()).second) << d;
  }
}

// A property of all pairs needs a pass over all of them: only once after many changes.
TEST(SeparationTable, WhatIsSaidOfAllPairsFollowsWhenItSettles) {
  SeparationTable table(scene_of(3), 0);
  const std::uint64_t before = table.version();
  table.set(0, 1, 3);
  table.set(1, 1, 2);
  EXPECT_EQ(table.of(1, 0), 3);
  EXPECT_NE(table.version(), before);
  EXPECT_FALSE(table.any());
  table.settle();
  EXPECT_TRUE(table.any());
  EXPECT_EQ(table.largest(), (std::vector<double>{3, 3, 0}));
}

TEST(SeparationTable, OfASceneWithoutMeshes) {
  const SeparationTable table(Scene{}, 0.5);
  EXPECT_EQ(table.most(), 0);
  EXPECT_EQ(table.first(), 0);
  EXPECT_FALSE(table.any());
  EXPECT_TRUE(table.uniform());
}

}  // namespace
}  // namespace hpccd
