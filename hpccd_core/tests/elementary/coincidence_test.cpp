// SPDX-License-Identifier: Apache-2.0
// share_a_place decides as integers do: on a coarse lattice, where vertices often coincide.
#include "elementary/coincidence.h"

#include <gtest/gtest.h>

#include <random>

#include "elementary/exact/distance.h"
#include "elementary/exact/intersection.h"

namespace hpccd {
namespace {

template <int n>
void fill(std::mt19937_64& random, Vec3<double> (&q)[n]) {
  std::uniform_int_distribution<int> any(-1, 1);
  for (Vec3<double>& x : q)
    x = {static_cast<double>(any(random)), static_cast<double>(any(random)), static_cast<double>(any(random))};
}

TEST(Coincidence, MeansDistanceZeroAndIntersection) {
  std::mt19937_64 random(1);
  int shared = 0, apart = 0;
  for (int i = 0; i < 3000; ++i) {
    Vec3<double> pair[4], edge_face[5];
    fill(random, pair), fill(random, edge_face);
    if (share_a_place<1>(pair)) {
      ++shared;
      EXPECT_TRUE(exact::within(Kind::vertex_face, pair, 0));
      EXPECT_EQ(exact::distance(Kind::vertex_face, pair), 0);
    }
    if (share_a_place<2>(pair)) {
      EXPECT_EQ(exact::distance(Kind::edge_edge, pair), 0);
    } else if (exact::distance(Kind::edge_edge, pair) > 0) {
      ++apart;
    }
    if (share_a_place<2>(edge_face)) {
      EXPECT_TRUE(exact::intersect(edge_face));
    }
  }
  EXPECT_GT(shared, 100);
  EXPECT_GT(apart, 100);
}

}  // namespace
}  // namespace hpccd
