// SPDX-License-Identifier: Apache-2.0
#include "contacts/gaps.h"

#include <gtest/gtest.h>

#include "grid_scene.h"

namespace hpccd {
namespace {

struct Nothing {
  std::shared_ptr<const Scene> scene = test::two_sheets(3);
  Features features = features_of(*scene);
  MeshPairs pairs{PairRules(*scene, Accuracy::exact, SeparationTable(*scene, 0)), scene->meshes().size()};
  NearestPairs nearest{pairs, features, MotionBounds()};
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
