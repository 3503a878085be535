// SPDX-License-Identifier: Apache-2.0
// When a list of near pairs suffices for a query, and when the next list pays off.
#include "backends/near_list.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace hpccd {
namespace {

constexpr double inf = std::numeric_limits<double>::infinity();

VertexMotion vertex(Vec3<double> t0, Vec3<double> t1) { return {{t0.x, t0.y, t0.z, 0}, {t1.x, t1.y, t1.z, 0}}; }

TEST(NearList, TravelBoundsEveryWay) {
  ThreadPool pool{2};
  NearList list;
  const std::vector<VertexMotion> motion{vertex({0, 0, 0}, {3, 4, 0}), vertex({1, 1, 1}, {1, 1, 1})};
  const Travel unknown = list.see(motion, pool);
  EXPECT_EQ(unknown.away, inf);
  EXPECT_GE(unknown.way, 5);
  list.keep({}, 0.5, motion, pool);
  EXPECT_EQ(list.see(motion, pool).away, 0);
  const std::vector<VertexMotion> elsewhere{vertex({0, 0, 0}, {0, 0, 0}), vertex({1, 1.25, 1}, {1, 1, 1})};
  const Travel moved = list.see(elsewhere, pool);
  EXPECT_GE(moved.away, 0.25);
  EXPECT_GE(moved.way, 0.25);
  EXPECT_EQ(list.see({}, pool).away, inf);  // another scene
}

TEST(NearList, WithoutAListTheSnapshotIsTheLastStart) {
  ThreadPool pool{2};
  NearList list;
  const std::vector<VertexMotion> here{vertex({0, 0, 0}, {1, 0, 0})}, there{vertex({0, 2, 0}, {1, 2, 0})};
  list.see(here, pool);
  EXPECT_EQ(list.see(here, pool).away, 0);
  EXPECT_GE(list.see(there, pool).away, 2);
  EXPECT_EQ(list.see(there, pool).away, 0);
  list.keep({}, 0.5, here, pool);
  for (int i = 0; i < 2; ++i) EXPECT_GE(list.see(there, pool).away, 2);
  list.forget();
  EXPECT_GE(list.see(there, pool).away, 2);
  EXPECT_EQ(list.see(there, pool).away, 0);
}

TEST(NearList, WaysTooSmallToSquareCount) {
  ThreadPool pool{1};
  NearList list;
  list.keep({}, 0, {vertex({0, 0, 0}, {0, 0, 0})}, pool);
  const Travel t = list.see({vertex({1e-300, 0, 0}, {2e-300, 0, 0})}, pool);
  EXPECT_GE(t.away, 1e-300);
  EXPECT_GE(t.way, 1e-300);
  EXPECT_FALSE(list.radius().answers(1, t));
}

// Where 0.006 of 27 rounds to none, and the root of 27 to 5.
TEST(Travel, IsABoundAmongDenormalNumbers) {
  const double least = std::numeric_limits<double>::denorm_min();
  EXPECT_GE(Travel::along_axes(3 * least, 0).away, 6 * least);
  EXPECT_GE((Travel{0, 27 * least}).until(0.006), least);
  EXPECT_EQ(Travel::along_axes(0, 0).way, 0);
}

TEST(NearRadius, AnswersAsFarAsItReaches) {
  NearRadius radius;
  EXPECT_FALSE(radius.answers(0, {0, 0}));
  radius.set(1);
  EXPECT_TRUE(radius.answers(0.5, {0, 1.9}));
  EXPECT_TRUE(radius.answers(inf, {0, 0.9}));  // nothing touches: up to the end
  EXPECT_FALSE(radius.answers(inf, {0, 1}));   // what is reported at the very end may touch within its rounding
  EXPECT_FALSE(radius.answers(0.5, {0.6, 1}));
  EXPECT_FALSE(radius.answers(0, {inf, 0}));
  radius.forget();
  EXPECT_FALSE(radius.answers(0, {0, 0}));
}

TEST(NearRadius, PaysWhereStartsComeAgain) {
  NearRadius radius;
  radius.edge = 1;
  EXPECT_TRUE(radius.next_would_pay({0, 5}));  // where the last motion began
  EXPECT_FALSE(radius.next_would_pay({0.1, 5}));
  EXPECT_FALSE(radius.next_would_pay({inf, 5}));
  radius.set(1);
  EXPECT_TRUE(radius.answers(1, {0, 0.1}));  // what it was made for
  EXPECT_FALSE(radius.next_would_pay({0.1, 5}));
  EXPECT_TRUE(radius.answers(1, {0, 0.1}));
  EXPECT_TRUE(radius.next_would_pay({0.1, 5}));
}

TEST(NearRadius, IsKeptWhereSomeMotionsGoTooFar) {
  NearRadius radius;
  EXPECT_TRUE(radius.failed({0, 5}));  // there is none
  radius.set(1);
  EXPECT_FALSE(radius.failed({0, 5}));
  EXPECT_FALSE(radius.failed({0.5, 5}));
  EXPECT_TRUE(radius.answers(0.1, {0, 5}));
  for (int i = 0; i < 2; ++i) EXPECT_FALSE(radius.failed({0, 5}));
  radius.helped();
  for (int i = 0; i < 2; ++i) EXPECT_FALSE(radius.failed({0, 5}));
  EXPECT_TRUE(radius.failed({0, 5}));
  radius.set(1);
  EXPECT_TRUE(radius.failed({1.5, 5}));  // motions begin elsewhere
}

TEST(NearRadius, RestsLongerTheMoreWiderOnesWereGivenUpFromOneStart) {
  NearRadius radius;
  radius.edge = 1;
  int calls = 0, tries = 0;
  for (; calls < 200; ++calls)
    if (radius.next_would_pay({0, 5}) && radius.wider_would_pay()) ++tries, radius.gave_up_wider();
  EXPECT_TRUE(tries > 4 && tries < 12) << tries;
  EXPECT_FALSE(radius.next_would_pay({1, 5}));  // another start
  EXPECT_TRUE(radius.wider_would_pay());
}

TEST(NearRadius, IsAtLeastTheWayAndNoneWhereNeighboursCouldMeet) {
  NearRadius radius;
  radius.edge = 1;
  EXPECT_GE(radius.next({0, 1}, 0.1).value(), 0.1);
  EXPECT_GT(radius.next({0, 0}, 1).value(), 0);
  EXPECT_FALSE(radius.next({0, 1}, 0.2));
  EXPECT_FALSE(radius.next({0, 1}, inf));
  EXPECT_FALSE(radius.next({0, inf}, 0.1));
  EXPECT_GT(listed_distance(0.5, 0.25).value(), 1.25);
  EXPECT_FALSE(listed_distance(std::nullopt, 0.25));
  EXPECT_FALSE(listed_distance(inf, 0.25));
}

}  // namespace
}  // namespace hpccd
