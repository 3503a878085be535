// SPDX-License-Identifier: Apache-2.0
#include "rigid/joint_bounds.h"

#include <gtest/gtest.h>

#include <thread>

#include "hpccd/errors.h"
#include "rigid/arm.h"

namespace hpccd::rigid {
namespace {

constexpr auto fixed = JointKind::fixed, turning = JointKind::turning, sliding = JointKind::sliding;
constexpr Ball ball{0.5, 0.5, {0, 0, 0}};
constexpr double room = 1e-10;

using Values = std::vector<double>;

TEST(JointBounds, OneJointThatTurnsAloneHasTheAccelerationOfItsCircle) {
  const LinkBounds found = JointBounds(test::arm({turning}), Values{0}, Values{0.01}, {}).of_link(0, ball);
  EXPECT_GE(found.acceleration, 0.5 * 0.01 * 0.01);
  EXPECT_LE(found.acceleration, 0.5 * 0.01 * 0.01 * (1 + room));
  EXPECT_GE(found.span, 0.5);
  EXPECT_LE(found.span, 0.5 * (1 + room));
}

TEST(JointBounds, TurnsAgainstEachOtherBendThePathOfALinkThatDoesNotTurn) {
  const double turn = 1e-4;
  const LinkBounds found =
      JointBounds(test::arm({turning, turning}), Values{0, 0}, Values{turn, -turn}, {}).of_link(1, ball);
  EXPECT_GE(found.acceleration, turn * turn);
  EXPECT_LE(found.acceleration, turn * turn * 1.001);  // of the first joint, at the distance 1: the ball adds nothing
  EXPECT_GE(found.span, 1.5);
}

TEST(JointBounds, WhatSlidesFirstDoesNotBend) {
  const LinkBounds found =
      JointBounds(test::arm({sliding, sliding, fixed}), Values{0, 0, 7}, Values{1, -2, 9}, {}).of_link(2, ball);
  EXPECT_EQ(found.acceleration, 0);
  EXPECT_GE(found.span, 1 + 2 + 2 + 0.5);
}

TEST(JointBounds, ASlideOnWhatTurnsBends) {
  const auto of = [&](double way) {
    return JointBounds(test::arm({turning, sliding}), Values{0, 0}, Values{0.01, way}, {}).of_link(1, ball);
  };
  EXPECT_GT(of(3.0).acceleration, 2 * 0.01 * 3.0);
  EXPECT_LT(of(0.0).acceleration, 2 * 0.01 * 0.01);
}

TEST(JointBounds, NothingThatRestsHasABoundOfItsMotion) {
  const JointBounds bounds(test::arm({turning, turning, sliding}), Values{1, 2, 3}, Values{1, 2, 3}, {});
  for (std::size_t link : {0, 1, 2}) {
    const LinkBounds found = bounds.of_link(link, ball);
    EXPECT_EQ(found.acceleration, 0);
    EXPECT_EQ(found.span, 0);
    EXPECT_GT(found.rounding, 0);
  }
}

TEST(JointBounds, JointsOnOtherBranchesDoNotMatter) {
  auto joints = test::arm_joints({turning, turning, turning});
  joints[2].parent = 0;
  const auto tree = std::make_shared<const JointChain>(joints);
  const LinkBounds rests = JointBounds(tree, Values{0, 0, 0}, Values{0.1, 0.0, 0.2}, {}).of_link(2, ball);
  const LinkBounds moves = JointBounds(tree, Values{0, 0, 0}, Values{0.1, 9.0, 0.2}, {}).of_link(2, ball);
  EXPECT_EQ(rests.acceleration, moves.acceleration);
  EXPECT_EQ(rests.span, moves.span);
  EXPECT_EQ(rests.rounding, moves.rounding);
}

TEST(JointBounds, AFarBaseMattersToRoundingAlone) {
  const auto of = [&](double far) {
    return JointBounds(test::arm({turning}), Values{0}, Values{0.01}, {{}, {far, 0, 0}}).of_link(0, ball);
  };
  EXPECT_EQ(of(1e6).span, of(0).span);
  EXPECT_GT(of(1e6).rounding, 1e6 * of(0).rounding);
}

TEST(JointBounds, ThreadsMayShareThem) {
  const JointBounds bounds(test::arm(std::vector(12, turning)), Values(12, 0.0), Values(12, 0.1), {});
  const double alone = bounds.of_link(11, ball).acceleration;
  std::vector<double> found(4);
  {
    std::vector<std::jthread> threads;
    for (double& own : found)
      threads.emplace_back([&own, &bounds] {
        for (int k = 0; k < 100; ++k) own = bounds.of_link(11, ball).acceleration;
      });
  }
  EXPECT_EQ(found, std::vector(4, alone));
}

TEST(JointBounds, RefusesOtherNumbersOfValuesAndLinksThatAreNone) {
  EXPECT_THROW(JointBounds(test::arm({turning}), Values{}, Values{0}, {}), InvalidArgument);
  EXPECT_THROW(JointBounds(test::arm({turning}), Values{0}, Values{0, 1}, {}), InvalidArgument);
  const JointBounds bounds(test::arm({turning}), Values{0}, Values{1}, {});
  EXPECT_THROW(bounds.of_link(1, ball), InvalidArgument);
}

}  // namespace
}  // namespace hpccd::rigid
