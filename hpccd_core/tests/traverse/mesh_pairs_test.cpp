// SPDX-License-Identifier: Apache-2.0
#include "traverse/mesh_pairs.h"

#include <gtest/gtest.h>

namespace hpccd {
namespace {

constexpr std::uint32_t n = 4;

MeshPairs pairs_of(const Scene& scene) {
  return {PairRules(scene, Accuracy::exact, SeparationTable(scene, 0)), scene.meshes().size()};
}

Scene points() {
  Scene scene;
  for (std::uint32_t m = 0; m < n; ++m) scene.add_mesh(std::to_string(m), {}, 1, {.self_collision = m != 1});
  return scene;
}

TEST(MeshPairs, AreNumberedInOrder) {
  const MeshPairs pairs = pairs_of(points());
  ASSERT_EQ(pairs.size(), n * (n + 1) / 2 - 1);
  std::size_t number = 0;
  for (std::uint32_t a = 0; a < n; ++a)
    for (std::uint32_t b = a; b < n; ++b) {
      if (a == 1 && b == 1) continue;
      EXPECT_EQ(pairs[number], (std::array{a, b}));
      EXPECT_EQ(pairs.number(a, b), number);
      EXPECT_EQ(pairs.number(b, a), number);
      ++number;
    }
}

TEST(MeshPairs, AreThoseThatTheSceneEnables) {
  Scene scene = points();
  for (std::uint32_t a = 0; a < n; ++a)
    for (std::uint32_t b = 0; b < a; ++b) scene.ignore_pair(a, b);
  const MeshPairs pairs = pairs_of(scene);
  ASSERT_EQ(pairs.size(), n - 1);
  for (std::uint32_t i = 0; i < pairs.size(); ++i) {
    EXPECT_EQ(pairs[i][0], pairs[i][1]);
    EXPECT_EQ(pairs.number(pairs[i][0], pairs[i][1]), i);
  }
}

TEST(MeshPairs, OfNoMeshes) { EXPECT_EQ(pairs_of(Scene()).size(), 0u); }

}  // namespace
}  // namespace hpccd
