// SPDX-License-Identifier: Apache-2.0
#include "rigid/joint_chain.h"

#include <gtest/gtest.h>

#include <numbers>

#include "hpccd/errors.h"
#include "rigid/arm.h"

namespace hpccd::rigid {
namespace {

constexpr auto fixed = JointKind::fixed, turning = JointKind::turning, sliding = JointKind::sliding;
constexpr double quarter = std::numbers::pi / 2;

void expect_near(const Vector& found, const Vector& expected) {
  EXPECT_NEAR(found.x, expected.x, 1e-15);
  EXPECT_NEAR(found.y, expected.y, 1e-15);
  EXPECT_NEAR(found.z, expected.z, 1e-15);
}

TEST(JointChain, JointsMoveWhatComesAfterThem) {
  const auto poses = test::arm({turning, turning, sliding, fixed})->poses(std::vector{quarter, -quarter, 0.5, 9.0}, {});
  expect_near(poses[0].shift, {0, 0, 0});
  expect_near(poses[1].shift, {0, 1, 0});
  expect_near(poses[2].shift, {1.5, 1, 0});
  expect_near(poses[3].shift, {2.5, 1, 0});
  expect_near(rotated(rotation_of(poses[0].turn), {1, 0, 0}), {0, 1, 0});
  expect_near(rotated(rotation_of(poses[3].turn), {1, 0, 0}), {1, 0, 0});
}

TEST(JointChain, BranchesMoveByTheirOwnJointsAlone) {
  auto joints = test::arm_joints({turning, sliding, sliding});
  joints[2].parent = 0;
  const auto poses = JointChain(joints).poses(std::vector{quarter, 0.5, 0.25}, {});
  expect_near(poses[1].shift, {0, 1.5, 0});
  expect_near(poses[2].shift, {0, 1.25, 0});
}

TEST(JointChain, TheBasePlacesAll) {
  const Pose base = after({{}, {1, 2, 3}}, {{0, 0, 1, 0}, {0, 0, 0}});  // half a turn about z
  const auto poses = test::arm({fixed, fixed})->poses(std::vector{0.0, 0.0}, base);
  expect_near(poses[0].shift, {1, 2, 3});
  expect_near(poses[1].shift, {0, 2, 3});
}

TEST(JointChain, MayHaveNoJoints) { EXPECT_TRUE(test::arm({})->poses({}, {}).empty()); }

TEST(JointChain, RefusesParentsThatDoNotComeBeforeAndOtherNumbersOfValues) {
  for (const int parent : {-2, 1, 7}) {
    auto joints = test::arm_joints({turning, turning});
    joints[1].parent = parent;
    EXPECT_THROW(JointChain{joints}, InvalidArgument) << parent;
  }
  EXPECT_THROW(test::arm({turning})->poses({}, {}), InvalidArgument);
}

}  // namespace
}  // namespace hpccd::rigid
