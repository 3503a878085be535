// SPDX-License-Identifier: Apache-2.0
// Integers of fixed size against those of any size: on the widest coordinates that each size takes, nothing overflows.
#include <gtest/gtest.h>

#include <random>

#include "elementary/exact/wide/approach.h"
#include "elementary/exact/wide/earliest.h"

namespace hpccd::exact {
namespace {

using Numbers = std::array<std::int64_t, 24>;  // 4 points at t = 0, then at t = 1

// Magnitudes below 2^60 that reach the limit, with many equal ones, so that contacts and degeneracies are common.
Numbers wide_numbers(std::mt19937_64& random) {
  constexpr std::int64_t limit = (std::int64_t{1} << 60) - 1;
  const std::int64_t values[] = {limit,
                                 -limit,
                                 limit / 2 + 1,
                                 -(limit / 2 + 1),
                                 0,
                                 1,
                                 static_cast<std::int64_t>(random() % limit),
                                 -static_cast<std::int64_t>(random() % limit)};
  const std::size_t few = random() % 3 ? 8 : 5;
  Numbers numbers;
  for (auto& x : numbers) x = values[random() % few];
  return numbers;
}

template <class Z>
Z widened(std::int64_t x, int bits) {
  return Z(shifted<0>(Z(x), bits));
}

template <class Z>
Query<Z> query(Kind kind, const Numbers& numbers, int bits) {
  Coordinates<Z> points[4];
  for (int i = 0; i < 4; ++i)
    for (int k = 0; k < 3; ++k) {
      const Z z0 = widened<Z>(numbers[3 * i + k], bits), z1 = widened<Z>(numbers[12 + 3 * i + k], bits);
      // The lowest bits in use too, where there is room below.
      const Z low(bits ? numbers[3 * i + k] >> 8 : 0);
      points[i][k] = {{z0 + low, z1 - z0}};
    }
  return {kind, points};
}

template <class Z>
void expect_same_as_big(int bits) {
  std::mt19937_64 random(7);
  int contacts = 0, decided = 0;
  constexpr int n = 20000;
  for (int i = 0; i < n; ++i) {
    const Numbers numbers = wide_numbers(random);
    const Kind kind = i % 2 ? Kind::vertex_face : Kind::edge_edge;
    const Answer fixed = earliest(query<Z>(kind, numbers, bits)), big = earliest(query<Big>(kind, numbers, bits));
    ASSERT_TRUE(big.decided);
    if (!fixed.decided) continue;
    ++decided;
    contacts += fixed.toc.has_value();
    ASSERT_EQ(fixed.toc, big.toc) << "query " << i;
  }
  EXPECT_GT(contacts, n / 10);
  EXPECT_GT(decided, n * 9 / 10);
}

void expect_near(const Vec3<double>& a, const Vec3<double>& b) {
  // With integers of fixed size t is known to 2^-62, where n may nearly vanish.
  const double tolerance = 1e-4 * std::max({std::fabs(b.x), std::fabs(b.y), std::fabs(b.z)});
  EXPECT_NEAR(a.x, b.x, tolerance);
  EXPECT_NEAR(a.y, b.y, tolerance);
  EXPECT_NEAR(a.z, b.z, tolerance);
}

template <class Z>
void expect_same_approach_as_big(int bits) {
  std::mt19937_64 random(11);
  const int low[3] = {0, -3, 40};
  int sides[3] = {}, decided = 0, contacts = 0;
  constexpr int n = 20000;
  for (int i = 0; i < n; ++i) {
    const Numbers numbers = wide_numbers(random);
    const Kind kind = i % 2 ? Kind::vertex_face : Kind::edge_edge;
    const auto big = query<Big>(kind, numbers, bits);
    const auto contact = earliest(big).toc;
    if (!contact) continue;
    ++contacts;
    const auto fixed = approach(query<Z>(kind, numbers, bits), low, *contact);
    if (!fixed) continue;
    ++decided;
    const Approach expected = approach(big, low, *contact);
    ++sides[fixed->side + 1];
    ASSERT_EQ(fixed->side, expected.side) << "query " << i;
    expect_near(fixed->n, expected.n);
    ASSERT_FALSE(::testing::Test::HasFailure()) << "query " << i;
  }
  EXPECT_GT(contacts, n / 10);
  EXPECT_GT(decided, contacts * 9 / 10);
  for (const int k : {0, 2}) EXPECT_GT(sides[k], contacts / 10);
}

TEST(ExactIntegers, SidesOfOneLimbAgreeWithAnySize) { expect_same_approach_as_big<Integer<1>>(0); }
TEST(ExactIntegers, SidesOfTwoLimbsAgreeWithAnySize) { expect_same_approach_as_big<Integer<2>>(64); }

TEST(ExactIntegers, OneLimbAgreesWithAnySize) { expect_same_as_big<Integer<1>>(0); }
TEST(ExactIntegers, TwoLimbsAgreeWithAnySize) { expect_same_as_big<Integer<2>>(64); }

TEST(ExactIntegers, ProductsAndShiftsAreThoseOfAnySize) {
  std::mt19937_64 random(3);
  const auto big = [](const auto& x) {
    Big y = 0;
    for (std::size_t i = x.limbs.size(); i-- > 0;) y = (y << 64) + x.limbs[i];
    return x.negative() ? Big(y - (Big(1) << 64 * static_cast<int>(x.limbs.size()))) : y;
  };
  for (int i = 0; i < 1000; ++i) {
    Integer<3> a;
    Integer<2> b;
    const std::uint64_t patterns[] = {0, ~std::uint64_t{0}, std::uint64_t{1} << 63, random()};
    for (auto& limb : a.limbs) limb = patterns[random() % 4];
    for (auto& limb : b.limbs) limb = patterns[random() % 4];
    EXPECT_EQ(big(a * b), big(a) * big(b));
    EXPECT_EQ(sign(a), sign(big(a)));
    const int bits = static_cast<int>(random() % 128);
    EXPECT_EQ(big(shifted<2>(a, bits)), Big(big(a) << bits));
    int e, e_big;
    const double m = magnitude_of(a, e), m_big = magnitude_of(big(a), e_big);
    EXPECT_NEAR(std::ldexp(m, e - e_big), m_big, 1e-15);
  }
}

}  // namespace
}  // namespace hpccd::exact
