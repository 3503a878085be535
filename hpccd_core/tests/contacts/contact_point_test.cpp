// SPDX-License-Identifier: Apache-2.0
// Sides of contacts: those that doubles are sure of against exact arithmetic, and exact arithmetic itself.
#include "contacts/contact_point.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "contacts/places.h"
#include "elementary/exact/contact.h"

namespace hpccd {
namespace {

using V = Vec3<double>;

struct Moving {
  V t0[4], t1[4];
};

// Without a separation.
PairPlaces places_of(Kind kind, const Moving& q, double toc) {
  UndecidedPair pair{kind, {}, {}, 0};
  for (int i = 0; i < 4; ++i) pair.t0[i] = q.t0[i], pair.t1[i] = q.t1[i];
  return pair_places(pair, toc, {true, true, false, false, AtTime::contact});
}

// Steps of any length: the shorter, the more often the side at t = 0 is not that before the contact.
class RandomContacts : public ::testing::TestWithParam<std::tuple<Kind, double>> {};

TEST_P(RandomContacts, SidesAreThoseOfExactArithmetic) {
  const auto [kind, step] = GetParam();
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> real(-1, 1);
  const auto vector = [&](double scale) { return V{scale * real(random), scale * real(random), scale * real(random)}; };
  int contacts = 0;
  for (int i = 0; i < 100000; ++i) {
    Moving q;
    for (int k = 0; k < 4; ++k) q.t0[k] = vector(1), q.t1[k] = q.t0[k] + vector(step);
    const auto toc = exact::earliest_contact(kind, q.t0, q.t1);
    if (!toc) continue;
    ++contacts;
    const exact::Approach a = exact::approach(kind, q.t0, q.t1, *toc);
    EXPECT_LE(largest(places_of(kind, q, *toc).normal - a.side * unit(a.n)), 1e-9) << "query " << i;
  }
  EXPECT_GT(contacts, 100);
}

INSTANTIATE_TEST_SUITE_P(All, RandomContacts,
                         ::testing::Combine(::testing::Values(Kind::vertex_face, Kind::edge_edge),
                                            ::testing::Values(0.05, 0.5, 5.0)));

// A vertex at rest and a face whose corners pass through it one after the other, each along an axis of its own:
// p . (a x b) = -det(f0, f1, f2) = -(t - r)(t - s)(t - u).
Moving with_roots(double r, double s, double u) {
  Moving q;
  const double roots[3] = {r, s, u};
  q.t0[0] = q.t1[0] = {0, 0, 0};
  for (int k = 0; k < 3; ++k) {
    double at_t0[3] = {}, at_t1[3] = {};
    at_t0[k] = -roots[k], at_t1[k] = 1 - roots[k];
    q.t0[k + 1] = {at_t0[0], at_t0[1], at_t0[2]}, q.t1[k + 1] = {at_t1[0], at_t1[1], at_t1[2]};
  }
  return q;
}

TEST(Approach, SideIsThatBetweenTheRootBeforeAndTheContact) {
  const auto side = [](const Moving& q, double toc) {
    return exact::approach(Kind::vertex_face, q.t0, q.t1, toc).side;
  };
  const Moving three = with_roots(0.25, 0.5, 0.75);
  EXPECT_EQ(side(three, 0.25), 1);
  EXPECT_EQ(side(three, 0.5), -1);
  EXPECT_EQ(side(three, 0.75), 1);
  EXPECT_EQ(side(with_roots(0.25, 0.25, 0.75), 0.25), 1) << "a double root: comes and goes on one side";
  EXPECT_EQ(side(with_roots(0.25, 0.75, 0.75), 0.75), -1);
  EXPECT_EQ(side(with_roots(0.25, 0.25, 0.25), 0.25), 1);
  EXPECT_EQ(side(with_roots(0, 0.5, 0.75), 0), 1) << "at the start the motion goes on backwards in its straight lines";
  EXPECT_EQ(side(with_roots(0, 0, 0.75), 0), 1);
  EXPECT_EQ(side(with_roots(0, 0, 0), 0), 1);
  const double third = 1.0 / 3, after = std::nextafter(third, 1);
  EXPECT_EQ(side(with_roots(third, 0.75, 0.75), after), 1) << "a time that is rounded up";
}

TEST(Approach, OfRootsAtTheSameTimeTheFirstThatTouches) {
  const Moving q = with_roots(0.5, 0.5 + 1e-13, 0.9);
  for (const double toc : {0.5 - 1e-12, 0.5, 0.5 + 1e-13, 0.5 + 1e-12})
    EXPECT_EQ(exact::approach(Kind::vertex_face, q.t0, q.t1, toc).side, 1) << toc;
}

}  // namespace
}  // namespace hpccd
