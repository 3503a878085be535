// SPDX-License-Identifier: Apache-2.0
// Searches that are left and taken up again in lanes against each pair's own: the same bits, up to the time that an
// undecided one is known to be free.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <random>

#include "base/simd.h"
#include "elementary/distance/distance_batch.h"
#include "elementary/distance/extended_separation.h"
#include "elementary/distance/separation_test.h"
#include "elementary/exact/distance.h"
#include "elementary/undecided.h"

namespace hpccd {
namespace {

using V = Vec3<double>;

// Pairs 4 i to 4 i + 3 of vertices, whose features are number i, or edges 2 i and 2 i + 1.
struct Pairs {
  std::vector<VertexMotion> vertices;
  std::vector<std::array<std::uint32_t, 2>> edges;
  std::vector<std::array<std::uint32_t, 3>> faces;
  std::vector<std::uint32_t> first, second;
  std::vector<double> separations;

  void add(Kind kind, const V t0[4], const V t1[4], double d) {
    const auto v = static_cast<std::uint32_t>(vertices.size()), i = v / 4;
    for (int k = 0; k < 4; ++k) {
      VertexMotion m{};
      m.t0[0] = t0[k].x, m.t0[1] = t0[k].y, m.t0[2] = t0[k].z;
      m.t1[0] = t1[k].x, m.t1[1] = t1[k].y, m.t1[2] = t1[k].z;
      vertices.push_back(m);
    }
    edges.push_back({v, v + 1}), edges.push_back({v + 2, v + 3});
    faces.push_back({v + 1, v + 2, v + 3});
    first.push_back(kind == Kind::vertex_face ? v : 2 * i);
    second.push_back(kind == Kind::vertex_face ? i : 2 * i + 1);
    separations.push_back(d);
  }
  Geometry geometry() const {
    Geometry g{vertices.data(), edges.data(), faces.data()};
    g.separations.of_candidates = separations.data();
    return g;
  }
};

// A distance that is a few units of rounding more or less.
double about(double d, std::mt19937_64& random) { return d * (1 + 0x1p-50 * (static_cast<double>(random() % 17) - 8)); }

// Searches of all lengths: some that the ends decide, some that take a few steps, some that move together at the very
// distance, so that no step tells, and some that pass each other at that distance in the middle of the step.
Pairs pairs_of_all_lengths(Kind kind, std::uint32_t n, int seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> real(-1, 1);
  const auto anywhere = [&] { return V{real(random), real(random), real(random)}; };
  Pairs pairs;
  for (std::uint32_t i = 0; i < n; ++i) {
    V t0[4] = {anywhere(), anywhere(), anywhere(), anywhere()},
      t1[4] = {anywhere(), anywhere(), anywhere(), anywhere()};
    double d = std::pow(10.0, -4 * std::abs(real(random)));
    if (const auto which = random() % 3; which == 0) {
      const V motion = t1[0] - t0[0];
      for (int k = 0; k < 4; ++k) t1[k] = t0[k] + motion;
      d = about(exact::distance(kind, t0), random);
    } else if (which == 1) {
      // A corner at `corner`, with the rest of its feature behind it; the other feature passes before it.
      const V corner = anywhere(), n = {1, 0, 0}, way = {0, 0.3 * real(random), 0.5 + 0.4 * std::abs(real(random))};
      const V behind[2] = {corner + V{-1, 0.3 * real(random), 0}, corner + V{-1, 0.3 * real(random), 0.3}};
      const bool vf = kind == Kind::vertex_face;
      for (auto* at : {t0, t1}) {
        const V passing = corner + d * n + (at == t0 ? -1.0 : 1.0) * way, across = V{0, way.z, -way.y};
        const V edge[2] = {passing - across, passing + across};
        const V of_vf[4] = {passing, corner, behind[0], behind[1]}, of_ee[4] = {edge[0], edge[1], corner, behind[0]};
        std::copy_n(vf ? of_vf : of_ee, 4, at);
      }
      d = about(d, random);
    }
    pairs.add(kind, t0, t1, d);
  }
  return pairs;
}

template <Kind kind>
Outcome<double> alone(const Pairs& pairs, std::uint32_t i) {
  V t0[4], t1[4];
  pair_positions(pairs.geometry(), kind, pairs.first[i], pairs.second[i], t0, t1);
  const Motion<double> m = motion_of<kind>(t0, t1);
  if (planes_stay_apart(m, pairs.separations[i])) return {false, true, 0, 0};
  const Outcome<double> o = separation_filter<kind>(m, pairs.separations[i]);
  return o.contact || o.none ? o : separation_test<kind>(m, pairs.separations[i]);
}

class SearchLanes : public ::testing::TestWithParam<Kind> {};

TEST_P(SearchLanes, AnswerAsEachPairAlone) {
  for (const std::uint32_t n : {1u, 2u, 7u, 8u, 9u, 33u, batch_capacity}) {
    const Pairs pairs = pairs_of_all_lengths(GetParam(), n, 10 + static_cast<int>(n));
    int undecided = 0;
    for (const Simd simd : simd_levels()) {
      const auto found = std::make_unique<BatchResult>();
      separation_batch(simd)(pairs.geometry(), GetParam(), pairs.first.data(), pairs.second.data(), n, *found);
      std::map<std::uint32_t, double> contacts, open;
      for (std::uint32_t k = 0; k < found->n_contacts; ++k) contacts[found->contact[k]] = found->toc[k];
      for (std::uint32_t k = 0; k < found->n_undecided; ++k) open[found->undecided[k]] = found->apart_until[k];
      EXPECT_EQ(contacts.size(), found->n_contacts) << "each once";
      EXPECT_EQ(open.size(), found->n_undecided);
      for (std::uint32_t i = 0; i < n; ++i) {
        const Outcome<double> o =
            GetParam() == Kind::vertex_face ? alone<Kind::vertex_face>(pairs, i) : alone<Kind::edge_edge>(pairs, i);
        ASSERT_EQ(contacts.count(i), o.contact) << i;
        ASSERT_EQ(open.count(i), !o.contact && !o.none) << i;
        if (o.contact) ASSERT_EQ(contacts[i], o.toc);
        if (open.count(i)) ASSERT_EQ(open[i], o.toc);
      }
      const BatchCounts& c = found->counts;
      EXPECT_EQ(c.tested, n);
      EXPECT_EQ(c.kdop + c.coplanarity + c.projection + c.roots + c.separated + c.contacts + c.undecided, n);
      undecided += static_cast<int>(c.undecided);
    }
    if (n == batch_capacity) EXPECT_GT(undecided, 50) << "was aimed at";
  }
}

TEST_P(SearchLanes, WhatIsKnownToBeFreeNeedNotBeAskedAgain) {
  const std::uint32_t n = batch_capacity;
  const Pairs pairs = pairs_of_all_lengths(GetParam(), n, 3);
  const auto found = std::make_unique<BatchResult>();
  separation_batch(Simd::scalar)(pairs.geometry(), GetParam(), pairs.first.data(), pairs.second.data(), n, *found);
  int told = 0;
  for (std::uint32_t k = 0; k < found->n_undecided; ++k) {
    const std::uint32_t i = found->undecided[k];
    UndecidedPair pair{GetParam(), {}, {}, pairs.separations[i]};
    pair_positions(pairs.geometry(), GetParam(), pairs.first[i], pairs.second[i], pair.t0, pair.t1);
    FallbackCounts counts;
    const auto fresh = decide_separation(Accuracy::exact, pair, counts);
    pair.apart_until = found->apart_until[k];
    told += pair.apart_until > 0;
    EXPECT_EQ(decide_separation(Accuracy::exact, pair, counts), fresh);
  }
  EXPECT_GT(told, 5);
}

INSTANTIATE_TEST_SUITE_P(Kinds, SearchLanes, ::testing::Values(Kind::vertex_face, Kind::edge_edge));

}  // namespace
}  // namespace hpccd
