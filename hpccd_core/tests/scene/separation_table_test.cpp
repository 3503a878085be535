// SPDX-License-Identifier: Apache-2.0
#include "scene/separation_table.h"

#include <gtest/gtest.h>

namespace hpccd {
namespace {

Scene three_points() {
  Scene scene;
  for (const char* name : {"a", "b", "c"}) scene.add_mesh(name, {}, 1, {});
  return scene;
}

TEST(SeparationTable, KnowsThePairsOfTheSceneAndWhatHoldsOtherwise) {
  Scene scene = three_points();
  scene.set_separation(2, 0, 0.5);
  const SeparationTable table(scene, 0.25);
  EXPECT_EQ(table.of(0, 2), 0.5);
  EXPECT_EQ(table.of(2, 0), 0.5);
  EXPECT_EQ(table.of(1, 1), 0.25);
  EXPECT_TRUE(table.any());
  EXPECT_FALSE(table.uniform());
  EXPECT_EQ(table.most(), 0.5);
  EXPECT_EQ(table.largest(), (std::vector<double>{0.5, 0.25, 0.5}));
}

TEST(SeparationTable, WhatIsSaidOfAllPairsFollowsWhenItSettles) {
  SeparationTable table(three_points(), 0);
  const std::uint64_t before = table.version();
  table.set(0, 1, 3);
  table.set(1, 1, 2);
  EXPECT_EQ(table.of(1, 0), 3);
  EXPECT_NE(table.version(), before);
  EXPECT_FALSE(table.any());
  table.settle();
  EXPECT_TRUE(table.any());
  EXPECT_FALSE(table.uniform());
  EXPECT_EQ(table.most(), 3);
  EXPECT_EQ(table.largest(), (std::vector<double>{3, 3, 0}));
  table.set(0, 1, 0);
  table.set(1, 1, 0);
  table.settle();
  EXPECT_FALSE(table.any());
  EXPECT_TRUE(table.uniform());
  EXPECT_EQ(table.most(), 0);
  EXPECT_TRUE(table.largest().empty());
}

TEST(SeparationTable, OfNoMeshes) {
  const SeparationTable table(Scene(), 1);
  EXPECT_FALSE(table.any());
  EXPECT_TRUE(table.uniform());
  EXPECT_EQ(table.most(), 0);
}

}  // namespace
}  // namespace hpccd
