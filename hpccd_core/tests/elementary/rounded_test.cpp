// SPDX-License-Identifier: Apache-2.0
// Tests that begin in single precision, from rounded coordinates: never a contact less, or at another time, than in
// double precision alone, and of the tier that ends there few wrong results, the same with every instruction set.
// The backend decides with which of the two a step begins, so tiers that promise equal results must not depend on it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <random>
#include <set>

#include "elementary/batch.h"
#include "elementary/exact/contact.h"
#include "elementary/fallback.h"
#include "hpccd/hpccd.h"

namespace hpccd {
namespace {

// Pairs of features so long, somewhere in the range of rounded coordinates; `touching` puts corners on a lattice and
// moves them by what floats can hardly see.
struct Pairs {
  std::vector<VertexMotion> rows;
  std::vector<RoundedMotion> rounded;
  std::vector<std::array<std::uint32_t, 2>> edges;
  std::vector<std::array<std::uint32_t, 3>> faces;
  std::vector<std::uint32_t> first, second;

  Pairs(Kind kind, double length, bool touching, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> real(-1, 1);
    std::uniform_int_distribution<int> lattice(-2, 2), tiny(-11, -7);
    for (std::uint32_t i = 0; i < batch_capacity; ++i) {
      const double offset[3] = {real(random), real(random), real(random)};
      const double nudge = std::pow(10.0, tiny(random)) * lattice(random);
      for (int v = 0; v < 4; ++v) {
        VertexMotion row{};
        RoundedMotion near{};
        for (int k = 0; k < 3; ++k)
          for (int end = 0; end < 2; ++end) {
            const double x = touching ? 0.25 * lattice(random) + nudge * real(random) : 0.5 * real(random);
            (end ? row.t1 : row.t0)[k] = offset[k] + length * x;
            (end ? near.t1 : near.t0)[k] = static_cast<float>((end ? row.t1 : row.t0)[k]);
          }
        rows.push_back(row), rounded.push_back(near);
      }
      edges.push_back({4 * i, 4 * i + 1}), edges.push_back({4 * i + 2, 4 * i + 3});
      faces.push_back({4 * i + 1, 4 * i + 2, 4 * i + 3});
      first.push_back(kind == Kind::vertex_face ? 4 * i : 2 * i);
      second.push_back(kind == Kind::vertex_face ? i : 2 * i + 1);
    }
  }

  UndecidedPair pair(Kind kind, std::uint32_t i) const {
    UndecidedPair q{kind, {}, {}, 0};
    for (int v = 0; v < 4; ++v) {
      const VertexMotion& m = rows[4 * i + static_cast<std::uint32_t>(v)];
      q.t0[v] = {m.t0[0], m.t0[1], m.t0[2]}, q.t1[v] = {m.t1[0], m.t1[1], m.t1[2]};
    }
    return q;
  }

  std::optional<double> truth(Kind kind, std::uint32_t i) const {
    const UndecidedPair q = pair(kind, i);
    return exact::earliest_contact(kind, q.t0, q.t1);
  }

  // Flying needles: squeezed by these factors at first, then each corner moves independently.
  void make_needles(std::array<double, 3> squeeze, unsigned seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    for (std::size_t v = 0; v < rows.size(); ++v)
      for (std::size_t k = 0; k < 3; ++k) {
        rows[v].t0[k] = 0.25 * squeeze[k] * normal(random);
        rows[v].t1[k] = rows[v].t0[k] + 0.075 * normal(random);
        rounded[v].t0[k] = static_cast<float>(rows[v].t0[k]), rounded[v].t1[k] = static_cast<float>(rows[v].t1[k]);
      }
  }
};

struct Answers {
  std::map<std::uint32_t, double> contacts;
  std::set<std::uint32_t> undecided;
  BatchCounts counts;
};

Answers ask(const Pairs& pairs, Kind kind, Simd simd, Accuracy accuracy, bool from_rounded) {
  Geometry g{pairs.rows.data(), pairs.edges.data(), pairs.faces.data()};
  if (from_rounded) g.rounded = pairs.rounded.data();
  auto result = std::make_unique<BatchResult>();
  // Not a multiple of any number of lanes.
  constexpr std::uint32_t n = batch_capacity - 5;
  batch_test(simd, accuracy)(g, kind, pairs.first.data(), pairs.second.data(), n, *result);
  Answers a;
  for (std::uint32_t i = 0; i < result->n_contacts; ++i) a.contacts[result->contact[i]] = result->toc[i];
  a.undecided.insert(result->undecided, result->undecided + result->n_undecided);
  a.counts = result->counts;
  const BatchCounts& c = a.counts;
  EXPECT_EQ(c.tested, n);
  EXPECT_EQ(a.contacts.size(), result->n_contacts);
  EXPECT_EQ(a.undecided.size(), result->n_undecided);
  return a;
}

class Rounded : public testing::TestWithParam<std::tuple<Kind, double, bool>> {
 protected:
  const Kind kind = std::get<0>(GetParam());
  const double length = std::get<1>(GetParam());
  const bool touching = std::get<2>(GetParam());
};

TEST_P(Rounded, LeaveOutNothingThatTouches) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const Pairs pairs(kind, length, touching, seed);
    for (const Simd simd : simd_levels()) {
      const Answers doubles = ask(pairs, kind, simd, Accuracy::exact, false);
      const Answers both = ask(pairs, kind, simd, Accuracy::exact, true);
      EXPECT_EQ(doubles.contacts, both.contacts);
      for (const std::uint32_t i : both.undecided) EXPECT_TRUE(doubles.undecided.contains(i)) << i;
      for (const std::uint32_t i : doubles.undecided)
        if (!both.undecided.contains(i)) {
          EXPECT_FALSE(pairs.truth(kind, i)) << i;
        }
      const BatchCounts& c = both.counts;
      EXPECT_EQ(c.tested, c.kdop + c.coplanarity + c.projection + c.roots + c.contacts + c.undecided);
    }
  }
}

TEST_P(Rounded, TellTheSameByEveryInstructionSet) {
  const Pairs pairs(kind, length, touching, 99);
  const Answers scalar = ask(pairs, kind, Simd::scalar, Accuracy::fast, true);
  for (const Simd simd : simd_levels()) {
    const Answers lanes = ask(pairs, kind, simd, Accuracy::fast, true);
    EXPECT_EQ(scalar.contacts, lanes.contacts);
    EXPECT_EQ(scalar.undecided, lanes.undecided);
  }
}

INSTANTIATE_TEST_SUITE_P(Lengths, Rounded,
                         testing::Combine(testing::Values(Kind::vertex_face, Kind::edge_edge),
                                          testing::Values(1e-5, 1e-3, 1e-2, 1.0), testing::Bool()));

// One pair in 700 of these needles is so close to touching that a tolerance calls it a contact, though a filter can
// prove it apart. So every path has to ask the same filters.
TEST(Balanced, AnswersTheSameWithAndWithoutSinglePrecision) {
  for (const Kind kind : {Kind::vertex_face, Kind::edge_edge}) {
    for (unsigned seed = 1; seed <= 12; ++seed) {
      Pairs pairs(kind, 1, false, seed);
      std::array<double, 3> squeeze{1e-6, 1e-6, 1e-6};
      squeeze[seed % 3] = 1e-3;
      pairs.make_needles(squeeze, seed);
      const auto decided = [&](bool from_rounded) {
        Answers a = ask(pairs, kind, simd_levels().back(), Accuracy::balanced, from_rounded);
        FallbackCounts counts;
        for (const std::uint32_t i : a.undecided)
          if (const auto toc = decide_contact(Accuracy::balanced, pairs.pair(kind, i), counts)) a.contacts[i] = *toc;
        return a.contacts;
      };
      EXPECT_EQ(decided(false), decided(true)) << seed;
    }
  }
}

// A thousandth wrong is what the tier may be; times are good to 1e-4.
TEST(Fast, IsSeldomWrongWhereFeaturesAreNotTooSmall) {
  for (const Kind kind : {Kind::vertex_face, Kind::edge_edge}) {
    int wrong = 0, contacts = 0;
    for (unsigned seed = 1; seed <= 20; ++seed) {
      const Pairs pairs(kind, 1e-2, false, seed);
      const Answers fast = ask(pairs, kind, simd_levels().back(), Accuracy::fast, true);
      for (std::uint32_t i = 0; i < batch_capacity - 5; ++i) {
        const auto truth = pairs.truth(kind, i);
        contacts += truth.has_value();
        const auto told = fast.contacts.find(i);
        if (fast.undecided.contains(i)) continue;
        wrong += truth.has_value() != (told != fast.contacts.end());
        if (truth && told != fast.contacts.end()) wrong += std::abs(told->second - *truth) > 1e-3;
      }
    }
    EXPECT_GT(contacts, 500);
    EXPECT_LE(wrong * 200, contacts);
  }
}

}  // namespace
}  // namespace hpccd
