// SPDX-License-Identifier: Apache-2.0
// The certified search for the time within a separation against integers, and the instruction sets against each other.
#include "elementary/distance/separation_test.h"

#include <gtest/gtest.h>

#include <random>

#include "elementary/distance/distance_batch.h"
#include "elementary/distance/extended_separation.h"
#include "elementary/exact/distance.h"
#include "elementary/exact/separation.h"
#include "hpccd/hpccd.h"

namespace hpccd {
namespace {

using V = Vec3<double>;

struct Pair {
  V t0[4], t1[4];
  double d;
};

// Small integers over a power of two make distances that are exactly the separation likely.
std::vector<Pair> random_pairs(std::size_t n, bool lattice) {
  std::mt19937_64 random(lattice ? 5 : 6);
  std::uniform_real_distribution<double> real(-1, 1);
  std::uniform_int_distribution<int> whole(-3, 3);
  std::vector<Pair> pairs(n);
  for (Pair& q : pairs) {
    for (auto* points : {q.t0, q.t1})
      for (int i = 0; i < 4; ++i)
        for (double* x : {&points[i].x, &points[i].y, &points[i].z}) *x = lattice ? whole(random) : real(random);
    q.d = lattice ? 0.5 * (1 + random() % 4) : std::pow(10.0, -4 * std::abs(real(random)));
  }
  return pairs;
}

class Separation : public ::testing::TestWithParam<std::tuple<Kind, bool>> {
 protected:
  Kind kind() const { return std::get<0>(GetParam()); }
  std::vector<Pair> pairs(std::size_t n) const { return random_pairs(n, std::get<1>(GetParam())); }
};

template <Kind kind>
Outcome<double> filtered(const Pair& q) {
  const Motion<double> m = motion_of<kind>(q.t0, q.t1);
  if (planes_stay_apart(m, q.d)) return {false, true, 0, 0};
  const Outcome<double> o = separation_filter<kind>(m, q.d);
  return o.contact || o.none ? o : separation_test<kind>(m, q.d);
}

TEST_P(Separation, WhatTheFilterProvesIsWhatIntegersDecide) {
  int decided = 0, contacts = 0;
  for (const Pair& q : pairs(20000)) {
    const Outcome<double> o =
        kind() == Kind::vertex_face ? filtered<Kind::vertex_face>(q) : filtered<Kind::edge_edge>(q);
    if (!o.contact && !o.none) continue;
    ++decided;
    const auto exact = exact::earliest_within(kind(), q.t0, q.t1, q.d);
    ASSERT_EQ(o.contact, exact.has_value());
    ASSERT_NE(o.contact, o.none);
    if (!exact) continue;
    ++contacts;
    EXPECT_LE(o.toc, *exact + 1e-18) << "never late";
    EXPECT_NEAR(o.toc, *exact, separation_toc_radius);
  }
  EXPECT_GT(decided, 10000);
  EXPECT_GT(contacts, 2000);
}

// The features move together, at a distance that is a few units of rounding more or less than the separation.
std::vector<Pair> pairs_that_move_together(Kind kind, std::size_t n) {
  std::mt19937_64 random(7);
  std::vector<Pair> pairs = random_pairs(n, false);
  for (Pair& q : pairs) {
    const V motion = q.t1[0] - q.t0[0];
    for (int i = 0; i < 4; ++i) q.t1[i] = q.t0[i] + motion;
    q.d = exact::distance(kind, q.t0) * (1 + 0x1p-50 * (static_cast<double>(random() % 17) - 8));
  }
  return pairs;
}

TEST_P(Separation, TwiceThePrecisionDecidesMore) {
  const bool vf = kind() == Kind::vertex_face, lattice = std::get<1>(GetParam());
  int open = 0, decided = 0;
  for (const Pair& q : lattice ? random_pairs(20000, true) : pairs_that_move_together(kind(), 5000)) {
    const Outcome<double> o = vf ? filtered<Kind::vertex_face>(q) : filtered<Kind::edge_edge>(q);
    if (o.contact || o.none) continue;
    ++open;
    const auto a = vf ? extended_precision::earliest_within<Kind::vertex_face>(q.t0, q.t1, q.d)
                      : extended_precision::earliest_within<Kind::edge_edge>(q.t0, q.t1, q.d);
    if (!a.contact && !a.none) continue;
    ++decided;
    const auto exact = exact::earliest_within(kind(), q.t0, q.t1, q.d);
    ASSERT_EQ(a.contact, exact.has_value());
    if (exact) EXPECT_NEAR(a.toc, *exact, separation_toc_radius);
  }
  // On the lattice most of them are the separation exactly, which only integers can tell.
  EXPECT_GT(open, lattice ? 0 : 2500) << "was aimed at";
  EXPECT_GT(decided, lattice ? 0 : open / 2);
}

TEST_P(Separation, InstructionSetsGiveTheSameBits) {
  const auto given = pairs(3000);
  std::vector<Query> queries;
  for (const Pair& q : given) {
    Query row;
    for (int i = 0; i < 4; ++i) {
      row[3 * i] = q.t0[i].x, row[3 * i + 1] = q.t0[i].y, row[3 * i + 2] = q.t0[i].z;
      row[12 + 3 * i] = q.t1[i].x, row[13 + 3 * i] = q.t1[i].y, row[14 + 3 * i] = q.t1[i].z;
    }
    queries.push_back(row);
  }
  const auto ask = [&](Simd simd) {
    Options options;
    options.simd = simd, options.minimum_separation = 0.5;
    std::vector<double> toc(queries.size());
    const auto hit = std::make_unique<bool[]>(queries.size());
    (kind() == Kind::vertex_face ? test_vertex_face : test_edge_edge)(queries, options, hit.get(), toc.data());
    return toc;
  };
  const auto scalar = ask(Simd::scalar);
  for (const Simd simd : simd_levels()) EXPECT_EQ(ask(simd), scalar);
}

INSTANTIATE_TEST_SUITE_P(Kinds, Separation,
                         ::testing::Combine(::testing::Values(Kind::vertex_face, Kind::edge_edge), ::testing::Bool()));

TEST(Separation, StepsOfARisingTriangleStopBeforeTheVertex) {
  // The triangle x, y >= 0, x + y <= 1 rises from z = 0 to 1; the vertex waits above it at 1.25: 1.25 - t <= 0.5.
  const V t0[4] = {{0.25, 0.25, 1.25}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  const V t1[4] = {{0.25, 0.25, 1.25}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}};
  const Outcome<double> o = separation_test<Kind::vertex_face>(motion_of<Kind::vertex_face>(t0, t1), 0.5);
  ASSERT_TRUE(o.contact);
  EXPECT_LE(o.toc, 0.75);
  EXPECT_GE(o.toc, 0.75 - separation_toc_radius);
}

}  // namespace
}  // namespace hpccd
