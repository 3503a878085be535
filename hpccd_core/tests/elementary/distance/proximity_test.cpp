// SPDX-License-Identifier: Apache-2.0
// Proofs of the proximity test in lanes, against integers, most often a few roundings beside the border, where a
// margin that is too small is wrong; and the instruction sets against each other.
#include "elementary/distance/proximity_test.h"

#include <gtest/gtest.h>

#include <memory>
#include <random>

#include "elementary/distance/distance_batch.h"
#include "elementary/exact/distance.h"

namespace hpccd {
namespace {

using V = Vec3<double>;

enum class Points { anywhere, lattice, needles, far_away };

// Pair i has vertices 4 i ... 4 i + 3, and a limit of its own.
struct Pairs {
  std::vector<VertexMotion> vertices;
  std::vector<std::array<std::uint32_t, 2>> edges;
  std::vector<std::array<std::uint32_t, 3>> faces;
  std::vector<std::uint32_t> first, second;
  std::vector<double> limits;

  void add(Kind kind, const V q[4], double limit) {
    const auto v = static_cast<std::uint32_t>(vertices.size()), i = v / 4;
    for (int k = 0; k < 4; ++k) vertices.push_back({{q[k].x, q[k].y, q[k].z}, {q[k].x, q[k].y, q[k].z}});
    edges.push_back({v, v + 1}), edges.push_back({v + 2, v + 3});
    faces.push_back({v + 1, v + 2, v + 3});
    const bool vf = kind == Kind::vertex_face;
    first.push_back(vf ? v : 2 * i), second.push_back(vf ? i : 2 * i + 1);
    limits.push_back(limit);
  }
  void points(std::uint32_t i, V q[4]) const {
    for (int k = 0; k < 4; ++k) {
      const auto& x = vertices[4 * i + k].t0;
      q[k] = {x[0], x[1], x[2]};
    }
  }
};

V random_point(std::mt19937_64& random, Points kind) {
  std::uniform_real_distribution<double> real(-1, 1);
  std::uniform_int_distribution<int> whole(-3, 3);
  if (kind == Points::lattice) {
    const double x = whole(random), y = whole(random), z = whole(random);
    return {x, y, z};
  }
  const V p{real(random), real(random), real(random)};
  if (kind == Points::needles) return {p.x, 1e-4 * p.y, 1e-7 * p.z};
  if (kind == Points::far_away) return {p.x + 1e6, p.y, p.z - 3e5};
  return p;
}

Pairs random_pairs(Kind kind, Points points, double unit) {
  std::mt19937_64 random(11);
  Pairs pairs;
  for (std::uint32_t i = 0; i < batch_capacity; ++i) {
    V q[4];
    for (V& p : q) p = unit * random_point(random, points);
    const double distance = exact::distance(kind, q);
    const double beside = distance * (1 + 0x1p-52 * (static_cast<double>(random() % 129) - 64));
    pairs.add(kind, q, i % 4 == 0 ? 0.5 * unit : i % 4 == 1 ? distance : beside);
  }
  return pairs;
}

std::unique_ptr<BatchResult> ask(const Pairs& pairs, Kind kind, Simd simd) {
  Geometry g{pairs.vertices.data(), pairs.edges.data(), pairs.faces.data()};
  g.separations.of_candidates = pairs.limits.data();
  auto result = std::make_unique<BatchResult>();
  proximity_batch(simd)(g, kind, pairs.first.data(), pairs.second.data(), batch_capacity, *result);
  return result;
}

class Proximity : public ::testing::TestWithParam<std::tuple<Kind, Points>> {};

TEST_P(Proximity, WhatLanesProveIsWhatIntegersDecide) {
  const auto [kind, points] = GetParam();
  for (const double unit : {1.0, 0x1p-150, 0x1p-270, 0x1p-510, 0x1p-1060, 0x1p270, 0x1p490}) {
    const Pairs pairs = random_pairs(kind, points, unit);
    const auto found = ask(pairs, kind, Simd::scalar);
    enum Answer : char { far, near, open };
    std::vector<Answer> answers(batch_capacity, far);
    std::vector<double> distances(batch_capacity);
    for (std::uint32_t i = 0; i < found->n_contacts; ++i)
      answers[found->contact[i]] = near, distances[found->contact[i]] = found->toc[i];
    for (std::uint32_t i = 0; i < found->n_undecided; ++i) answers[found->undecided[i]] = open;
    for (std::uint32_t i = 0; i < batch_capacity; ++i) {
      if (answers[i] == open) continue;
      V q[4];
      pairs.points(i, q);
      ASSERT_EQ(answers[i] == near, exact::within(kind, q, pairs.limits[i])) << "pair " << i << " in units of " << unit;
      if (answers[i] == far) continue;
      double size = 0;
      for (const V& p : q) size = std::max(size, max_norm(p));
      ASSERT_NEAR(distances[i], exact::distance(kind, q), 1e-12 * size) << "pair " << i << " in units of " << unit;
    }
    if (unit != 1) continue;
    EXPECT_LT(found->n_undecided, batch_capacity * 4 / 5) << "most of what is not on the border is decided";
    EXPECT_GT(found->n_contacts, 20u);
    EXPECT_GT(found->counts.separated, 20u);
  }
}

TEST_P(Proximity, InstructionSetsGiveTheSameBits) {
  const auto [kind, points] = GetParam();
  const Pairs pairs = random_pairs(kind, points, 1);
  const auto scalar = ask(pairs, kind, Simd::scalar);
  for (const Simd simd : simd_levels()) {
    const auto other = ask(pairs, kind, simd);
    ASSERT_EQ(other->n_contacts, scalar->n_contacts);
    ASSERT_EQ(other->n_undecided, scalar->n_undecided);
    // Lanes are full at other places, but each list is in the order of the batch.
    for (std::uint32_t i = 0; i < scalar->n_contacts; ++i) {
      ASSERT_EQ(other->contact[i], scalar->contact[i]);
      ASSERT_EQ(other->toc[i], scalar->toc[i]);
    }
    for (std::uint32_t i = 0; i < scalar->n_undecided; ++i) ASSERT_EQ(other->undecided[i], scalar->undecided[i]);
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, Proximity,
                         ::testing::Combine(::testing::Values(Kind::vertex_face, Kind::edge_edge),
                                            ::testing::Values(Points::anywhere, Points::lattice, Points::needles,
                                                              Points::far_away)));

}  // namespace
}  // namespace hpccd
