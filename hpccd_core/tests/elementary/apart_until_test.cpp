// SPDX-License-Identifier: Apache-2.0
#include "elementary/apart_until.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "elementary/fallback.h"
#include "elementary/policy.h"

namespace hpccd {
namespace {

template <Kind kind>
void expect_no_contact_before(std::mt19937& random, double scale, double offset) {
  std::uniform_real_distribution<double> place(-1, 1);
  std::uniform_int_distribution<int> coarse(-2, 2), with_separation(0, 1);
  UndecidedPair pair{kind, {}, {}, with_separation(random) ? 0.25 * scale : 0.0};
  const bool on_lattice = with_separation(random);
  const auto coordinate = [&] { return offset + scale * (on_lattice ? 0.5 * coarse(random) : place(random)); };
  for (int i = 0; i < 4; ++i) {
    pair.t0[i] = {coordinate(), coordinate(), coordinate()};
    pair.t1[i] = {coordinate(), coordinate(), coordinate()};
  }
  FallbackCounts counts;
  const auto toc = pair.separation > 0 ? decide_separation(Accuracy::exact, pair, counts)
                                       : decide_contact(Accuracy::exact, pair, counts);
  const auto apart = [&](double time) { return apart_until<kind>(pair.t0, pair.t1, time, pair.separation); };
  if (!toc) return;
  EXPECT_FALSE(apart(std::min(1.0, *toc + same_time))) << *toc;  // what is reported may be rounded down
  EXPECT_FALSE(apart(1)) << *toc;
}

TEST(ApartUntil, NeverWhereTheyTouchByThen) {
  std::mt19937 random(1);
  for (int i = 0; i < 40000; ++i) {
    const double scale = i % 3 == 0 ? 1e-8 : 1.0, offset = i % 5 == 0 ? 1e6 : 0.0;
    expect_no_contact_before<Kind::vertex_face>(random, scale, offset);
    expect_no_contact_before<Kind::edge_edge>(random, scale, offset);
  }
}

TEST(ApartUntil, AsLongAsAnAxisKeepsThemApart) {
  // A vertex falls from 1 onto a face at 0, in time for the second half of the step.
  const Vec3<double> t0[4] = {{0, 0, 1}, {-1, -1, 0}, {1, -1, 0}, {0, 1, 0}};
  const Vec3<double> t1[4] = {{0, 0, -1}, {-1, -1, 0}, {1, -1, 0}, {0, 1, 0}};
  EXPECT_TRUE(apart_until<Kind::vertex_face>(t0, t1, 0.499, 0));
  EXPECT_FALSE(apart_until<Kind::vertex_face>(t0, t1, 0.5, 0));
  EXPECT_TRUE(apart_until<Kind::vertex_face>(t0, t1, 0.249, 0.5));
  EXPECT_FALSE(apart_until<Kind::vertex_face>(t0, t1, 0.25, 0.5));
}

}  // namespace
}  // namespace hpccd
