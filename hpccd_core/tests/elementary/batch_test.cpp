// SPDX-License-Identifier: Apache-2.0
// The filtered tests against exact arithmetic, and the instruction sets against each other: bit-identical.
#include "elementary/batch.h"

#include <gtest/gtest.h>

#include <cstring>
#include <random>

#include "elementary/exact/contact.h"
#include "elementary/extended_precision.h"
#include "hpccd/hpccd.h"

namespace hpccd {
namespace {

struct Answers {
  std::unique_ptr<bool[]> hit;
  std::vector<double> toc;
};

using QueryTest = void (*)(std::span<const Query>, const Options&, bool*, double*);

Answers ask(QueryTest test, const std::vector<Query>& queries, Accuracy accuracy, Simd simd) {
  Answers a{std::make_unique<bool[]>(queries.size()), std::vector<double>(queries.size())};
  Options options;
  options.accuracy = accuracy;
  options.simd = simd;
  test(queries, options, a.hit.get(), a.toc.data());
  return a;
}

// Small integers make every degeneracy likely; reals find the general case.
std::vector<Query> random_queries(std::size_t n, bool lattice) {
  std::mt19937_64 random(lattice ? 11 : 22);
  std::uniform_real_distribution<double> real(-1, 1);
  std::uniform_int_distribution<int> whole(-2, 2);
  std::vector<Query> queries(n);
  for (Query& q : queries)
    for (double& x : q) x = lattice ? whole(random) : real(random);
  return queries;
}

struct Points {
  Vec3<double> t0[4], t1[4];
  explicit Points(const Query& q) {
    for (int i = 0; i < 4; ++i) {
      t0[i] = {q[3 * i], q[3 * i + 1], q[3 * i + 2]};
      t1[i] = {q[12 + 3 * i], q[13 + 3 * i], q[14 + 3 * i]};
    }
  }
};

std::optional<double> exact_answer(Kind kind, const Query& q) {
  const Points points(q);
  return exact::earliest_contact(kind, points.t0, points.t1);
}

class Elementary : public ::testing::TestWithParam<std::tuple<Kind, bool>> {
 protected:
  Kind kind() const { return std::get<0>(GetParam()); }
  QueryTest test() const { return kind() == Kind::vertex_face ? test_vertex_face : test_edge_edge; }
  std::vector<Query> queries() const { return random_queries(20000, std::get<1>(GetParam())); }
};

TEST_P(Elementary, FiltersAgreeWithIntegerArithmetic) {
  const auto q = queries();
  const Answers a = ask(test(), q, Accuracy::exact, Simd::automatic);
  int contacts = 0;
  for (std::size_t i = 0; i < q.size(); ++i) {
    const auto truth = exact_answer(kind(), q[i]);
    ASSERT_EQ(a.hit[i], truth.has_value()) << "query " << i;
    if (truth) {
      ++contacts;
      EXPECT_NEAR(a.toc[i], *truth, 1e-12) << "query " << i;
    }
  }
  EXPECT_GT(contacts, 100);
}

// A device decides with 106 bits, the CPU with integers: the hash of all contacts must be the same.
TEST_P(Elementary, HundredAndSixBitsAnswerAsIntegersOrNotAtAll) {
  int contacts = 0, none = 0;
  for (const Query& q : queries()) {
    const Points points(q);
    const auto a = kind() == Kind::vertex_face ? extended_precision::decide<Kind::vertex_face>(points.t0, points.t1)
                                               : extended_precision::decide<Kind::edge_edge>(points.t0, points.t1);
    contacts += a.contact, none += a.none;
    if (!a.contact && !a.none) continue;
    const auto truth = exact_answer(kind(), q);
    ASSERT_EQ(a.contact, truth.has_value());
    if (truth) {
      ASSERT_EQ(a.toc, *truth);
    }
  }
  EXPECT_GT(contacts, 100);
  EXPECT_GT(none, 1000);
}

TEST_P(Elementary, ConservativeIsNeverLate) {
  const auto q = queries();
  const Answers sharp = ask(test(), q, Accuracy::exact, Simd::automatic);
  const Answers early = ask(test(), q, Accuracy::conservative, Simd::automatic);
  for (std::size_t i = 0; i < q.size(); ++i) {
    const auto truth = exact_answer(kind(), q[i]);
    if (truth) {
      EXPECT_TRUE(early.hit[i]);
      EXPECT_LE(early.toc[i], *truth + 0x1p-60);
    }
  }
}

TEST_P(Elementary, InstructionSetsGiveTheSameBits) {
  const auto q = queries();
  for (Accuracy accuracy : {Accuracy::fast, Accuracy::balanced, Accuracy::conservative, Accuracy::exact}) {
    const Answers scalar = ask(test(), q, accuracy, Simd::scalar);
    for (Simd simd : simd_levels()) {
      const Answers lanes = ask(test(), q, accuracy, simd);
      EXPECT_EQ(std::memcmp(scalar.hit.get(), lanes.hit.get(), q.size()), 0);
      EXPECT_EQ(std::memcmp(scalar.toc.data(), lanes.toc.data(), q.size() * sizeof(double)), 0);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, Elementary,
                         ::testing::Combine(::testing::Values(Kind::vertex_face, Kind::edge_edge), ::testing::Bool()));

}  // namespace
}  // namespace hpccd
